// The keys that a focused control takes for itself, and the order of scenes in the menu.

import assert from "node:assert/strict";
import { test } from "node:test";
import { isCharacter, isConsumed } from "../js/ui/keys.js";
import { hintText } from "../js/ui/prompts.js";
import { cardAfter, neighbour } from "../js/ui/scene-menu.js";

test("a focused select leaves all keys but those that move its choice to the page", () => {
  const select = { tagName: "SELECT" };
  for (const key of ["r", "R", " ", ".", "p"]) assert.equal(isConsumed(select, key), false, key);
  for (const key of ["ArrowDown", "Home", "Enter"]) assert.equal(isConsumed(select, key), true, key);
});

test("a focused slider takes arrows, a button and a switch take space, and a text field takes everything", () => {
  const range = { tagName: "INPUT", type: "range" };
  const text = { tagName: "INPUT", type: "text" };
  const button = { tagName: "BUTTON", type: "button" };
  const checkbox = { tagName: "INPUT", type: "checkbox" };
  assert.deepEqual([" ", "r", "ArrowLeft"].map((key) => isConsumed(range, key)), [false, false, true]);
  assert.deepEqual([" ", "r", "ArrowLeft"].map((key) => isConsumed(text, key)), [true, true, true]);
  assert.deepEqual([" ", "r", "Enter"].map((key) => isConsumed(button, key)), [true, false, true]);
  assert.deepEqual([" ", "r", "Enter"].map((key) => isConsumed(checkbox, key)), [true, false, true]);
});

test("the list of scenes continues at its start", () => {
  const scenes = ["a", "b", "c"].map((name) => ({ name, rate_hz: 60, dimensions: 3, text: "" }));
  assert.equal(neighbour(scenes, "c", 1)?.name, "a");
  assert.equal(neighbour(scenes, "a", -1)?.name, "c");
  assert.equal(neighbour(scenes, "own.toml", 1)?.name, "a");
  assert.equal(neighbour([], "a", 1), undefined);
});

test("arrows move between the cards of the menu, and stay within it", () => {
  assert.deepEqual(["ArrowRight", "ArrowDown", "ArrowUp", "ArrowLeft", "x"].map((key) => cardAfter(1, key, 4, 7)), [2, 5, 1, 0, 1]);
  assert.equal(cardAfter(6, "ArrowDown", 4, 7), 6);
});

test("the hint names what the scene has, and no right button on a touch screen", () => {
  const hint = (/** @type {string[]} */ ...shapes) => hintText(shapes.map((shape) => ({ shape })), false, "grab");
  assert.match(hint("cloth", "cloth"), /the cloth.*Right-drag/);
  assert.match(hint("bridge"), /the bridge/);
  assert.match(hint("cloth", "ragdoll"), /anything/);
  assert.match(hint(), /particle/);
  assert.doesNotMatch(hintText([{ shape: "cloth" }], true, "grab"), /Right/);
});

test("the hint says what a press does in the current mode", () => {
  const hint = (/** @type {import("../js/tools/input.js").Mode} */ mode) => hintText([{ shape: "cloth" }], false, mode);
  assert.equal(hint("brush"), "Drag over the cloth to push it. Right-drag cuts it.");
  assert.equal(hint("cut"), "Drag across the cloth to cut it.");
  assert.match(hint("pin"), /^Click a particle to pin it/);
  assert.match(hintText([], true, "pin"), /^Tap a particle/);
});

test("shortcuts that can be turned off are those of a single character", () => {
  for (const name of ["r", "3", "?", "]", "+"]) assert.ok(isCharacter(name), name);
  for (const name of [" ", "ctrl+z", "ArrowLeft", "Escape", "Tab"]) assert.ok(!isCharacter(name), name);
});
