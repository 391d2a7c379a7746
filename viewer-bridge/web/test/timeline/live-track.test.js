// The timeline of a live simulation: its range, and what the page says after it has gone on from an earlier state.

import assert from "node:assert/strict";
import { test } from "node:test";
import { goneOnText, rangeOfLast } from "../../js/timeline/live-track.js";

test("the timeline shows the last seconds, less where the past is shorter, and everything on demand", () => {
  assert.deepEqual(rangeOfLast(0, 24_000, 30, 240), { first: 16_800, last: 24_000 });
  assert.deepEqual(rangeOfLast(20_000, 24_000, 30, 240), { first: 20_000, last: 24_000 });
  assert.deepEqual(rangeOfLast(12, 24_000, 0, 240), { first: 12, last: 24_000 });
  assert.deepEqual(rangeOfLast(7, 7, 30, 240), { first: 7, last: 7 });
});

test("the page says if the node went on from another state than the one on show", () => {
  const outcome = { step: 1080, state_step: 480 };
  assert.deepEqual(goneOnText(480, outcome, 240), { text: "The simulation goes on from the state of 2.5 s ago.", level: "info" });
  const { text, level } = goneOnText(492, outcome, 240);
  assert.equal(level, "warning");
  assert.match(text, /no longer keeps step 492.*step 480, 0\.050 s earlier.*--history/);
});
