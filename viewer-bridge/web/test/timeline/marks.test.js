// The marks of a timeline, and its zoom.

import assert from "node:assert/strict";
import { test } from "node:test";
import { describe, legendOf, marksAt, stepOfMark } from "../../js/timeline/marks.js";
import { addressBeside } from "../../js/timeline/replay-track.js";
import { Scale, clockText, zoomed } from "../../js/timeline/timeline.js";

const marks = [{ kind: "tear", step: 100, count: 3 }, { kind: "pin", step: 200, count: 1, commands: ["pin"] }, { kind: "late", step: 200, count: 1 }, { kind: "command", step: 340, count: 9, commands: ["cut_radius", "mark: slips"] }];

test("a tooltip says when and what, and names the commands", () => {
  const lines = marks.map((mark) => describe(mark, (step) => clockText((step - 100) / 100)));
  assert.deepEqual(lines, [
    "0:00.000, step 100: 3 constraints torn",
    "0:01.000, step 200: pin",
    "0:01.000, step 200: 1 late step",
    "0:02.400, step 340: cut_radius, mark: slips (9 commands)",
  ]);
});

test("the next and the previous mark are the nearest ones beside the place", () => {
  assert.deepEqual([0, 100, 150, 200, 340].map((place) => stepOfMark(marks, place, 1)), [100, 200, 200, 340, null]);
  assert.deepEqual([0, 100, 150, 200, 340, 999].map((place) => stepOfMark(marks, place, -1)), [null, null, 100, 100, 200, 340]);
});

test("the pointer finds the marks within four pixels of a zoomed timeline", () => {
  const at = (scale, x) => marksAt(marks, scale, x, 1000).map(({ kind }) => kind);
  assert.deepEqual(at(new Scale(0, 1000), 203), ["pin", "late"]);
  assert.deepEqual(at(new Scale(0, 1000), 205), []);
  assert.deepEqual(at(new Scale(150, 250), 500), ["pin", "late"]);
  assert.deepEqual(at(new Scale(150, 250), 0), [], "a mark outside the range is not at its end");
});

test("the pages of a folder's recordings lie beside each other", () => {
  assert.equal(addressBeside("/", "run 2"), "/replay/run%202/");
  assert.equal(addressBeside("/replay/run/", "a.b"), "/replay/a.b/");
  assert.equal(addressBeside("/index.html", "run"), "/replay/run/");
  assert.equal(addressBeside("/replay/run/index.html", "run 2"), "/replay/run%202/");
  assert.equal(addressBeside("/lab/replay/run%202/", "run"), "/lab/replay/run/");
});

test("a zoomed timeline stays until the place leaves it, and never leaves the recording", () => {
  const whole = { first: 100, last: 1100 };
  assert.equal(zoomed(whole, whole, 500, 0), whole);
  assert.equal(zoomed(whole, whole, 500, 2000), whole);
  const part = zoomed(whole, whole, 500, 200);
  assert.deepEqual(part, { first: 450, last: 650 });
  assert.equal(zoomed(whole, part, 650, 200), part);
  assert.deepEqual(zoomed(whole, part, 651, 200), { first: 601, last: 801 });
  assert.deepEqual(zoomed(whole, part, 1100, 200), { first: 900, last: 1100 });
  assert.deepEqual(zoomed(whole, part, 100, 200), { first: 100, last: 300 });
  assert.deepEqual(zoomed(whole, part, 500, 20), { first: 495, last: 515 });
});

test("the legend counts the events of each kind, in a fixed order", () => {
  const more = [...marks, { kind: "ghost", step: 400, count: 1 }, { kind: "tear", step: 500, count: 2 }];
  assert.deepEqual(legendOf(more).map(({ kind, text }) => [kind, text]), [["tear", "torn 5"], ["pin", "pins 1"], ["command", "commands 9"], ["late", "late steps 1"], ["ghost", "first difference"]]);
});
