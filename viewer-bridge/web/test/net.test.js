// Reconnecting, and routing the outcomes of commands.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Commands } from "../js/net/commands.js";
import { closedText, delayBefore } from "../js/net/socket.js";

test("the delay before reconnecting doubles up to 5 s, plus up to half at random", () => {
  assert.deepEqual([0, 1, 2, 3, 4, 5, 20].map((failures) => delayBefore(failures, 0)), [250, 500, 1000, 2000, 4000, 5000, 5000]);
  assert.equal(delayBefore(0, 1), 375);
  assert.equal(delayBefore(20, 1), 7500);
});

test("the text of a final refusal says what to do", () => {
  assert.match(closedText(4401, "", false), /requires a token/);
  assert.match(closedText(4401, "", true), /token.*wrong/);
  assert.match(closedText(4426, "2", false), /Reload/);
  assert.match(closedText(1013, "", false), /Close one/);
  assert.match(closedText(1006, "", false), /No connection/);
});

test("an outcome goes to its caller, and a refusal also to the user", () => {
  const sent = [];
  const refused = [];
  const statuses = [];
  const commands = new Commands((message) => sent.push(message) > 0, (outcome) => refused.push(outcome.reason));
  commands.run("pin", { particle: 3 }, (outcome) => statuses.push(outcome.status));
  commands.run("cut", { constraint: 4 }, (outcome) => statuses.push(outcome.status));
  assert.deepEqual(sent.map(({ kind, id }) => [kind, id]), [["pin", 1], ["cut", 2]]);
  commands.receive({ id: 2, status: "rejected", reason: "unknown_constraint" });
  commands.receive({ id: 1, status: "applied", reason: "" });
  commands.receive({ id: null, status: "rejected", reason: "not_grabbed" });
  assert.deepEqual(statuses, ["rejected", "applied"]);
  assert.deepEqual(refused, ["unknown_constraint", "not_grabbed"]);
  assert.equal(commands.waiting.size, 0);
});
