// Undo: the keys that stand for it, and what the page does with the answer.

import assert from "node:assert/strict";
import { test } from "node:test";
import { isConsumed, keyName } from "../../js/ui/keys.js";
import { Strokes } from "../../js/tools/tool.js";
import { reactionTo, undoTitle } from "../../js/ui/undo.js";

const press = (key, rest = {}) => keyName({ key, ctrlKey: false, metaKey: false, altKey: false, shiftKey: false, repeat: false, ...rest });

test("Ctrl or Cmd and Z undo once per press, and other combinations belong to the browser", () => {
  assert.deepEqual([press("z", { ctrlKey: true }), press("Z", { metaKey: true })], ["ctrl+z", "ctrl+z"]);
  assert.equal(press("z", { ctrlKey: true, repeat: true }), null);
  assert.equal(press("z", { ctrlKey: true, shiftKey: true }), null);
  assert.equal(press("z", { altKey: true }), null);
  assert.deepEqual([press("R"), press("?", { shiftKey: true }), press("ArrowLeft", { repeat: true })], ["r", "?", "ArrowLeft"]);
});

test("all changes of one press are one stroke, and changes by keys are one if they follow each other", () => {
  const strokes = new Strokes();
  strokes.press();
  const first = strokes.ofChange(0);
  assert.equal(strokes.ofChange(60_000), first);
  strokes.release();
  const byKey = strokes.ofChange(60_001);
  assert.notEqual(byKey, first);
  assert.equal(strokes.ofChange(60_900), byKey);
  assert.notEqual(strokes.ofChange(62_000), byKey);
});

test("a text field keeps its own Ctrl+Z, a slider and a button do not", () => {
  assert.deepEqual(["text", "range", "checkbox"].map((type) => isConsumed({ tagName: "INPUT", type }, "z")), [true, false, false]);
  assert.equal(isConsumed({ tagName: "BUTTON" }, "z"), false);
});

test("the page says what was undone, and asks before it undoes what others have changed", () => {
  const outcome = { status: "rejected", reason: "changed_by_others", text: "others have made 2 changes since, and this would undo them as well" };
  assert.deepEqual(reactionTo(outcome), { question: "Others have made 2 changes since, and this would undo them as well." });
  assert.deepEqual(reactionTo({ status: "applied", reason: "", text: "Undid the cut." }), { notice: "Undid the cut." });
  // Every refusal is shown with its reason already.
  assert.equal(reactionTo({ status: "rejected", reason: "state_not_kept", text: "" }), null);
  assert.match(undoTitle("load"), /load of another scene.*Ctrl\+Z/);
});
