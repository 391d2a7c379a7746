// Quick requests for scenes are loaded one at a time, and only the newest one counts.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Commands } from "../js/net/commands.js";
import { Emitter } from "../js/state/emitter.js";
import { SceneLoader } from "../js/ui/scene-menu.js";

/** A loader with the list of the loads that it sends, and a function that answers the oldest one. */
function open() {
  const simulation = new Emitter();
  const sent = [];
  const refused = [];
  const commands = new Commands((message) => sent.push(message) > 0, (outcome) => refused.push(outcome));
  const loader = new SceneLoader(simulation, commands);
  let answered = 0;
  const answer = (status) => commands.receive({ id: sent[answered++].id, kind: "load", status });
  const names = () => sent.map(({ scene }) => scene);
  return { simulation, loader, names, answer, refused };
}

test("of requests during a load, only the newest is sent, after the answer", () => {
  const { simulation, loader, names, answer, refused } = open();
  for (const scene of ["rope", "flag", "ragdoll"]) loader.load(scene);
  assert.deepEqual([names(), loader.requested], [["rope"], "ragdoll"]);
  answer("applied");
  assert.deepEqual(names(), ["rope", "ragdoll"]);
  // The scene before it arrives late.
  simulation.emit("scene", { name: "rope" });
  assert.equal(loader.requested, "ragdoll");
  answer("applied");
  simulation.emit("scene", { name: "ragdoll" });
  assert.deepEqual([names().length, loader.requested, refused.length], [2, null, 0]);
});

test("the scene of the load under way is not loaded twice", () => {
  const { loader, names, answer } = open();
  for (const scene of ["rope", "flag", "rope"]) loader.load(scene);
  answer("applied");
  assert.deepEqual(names(), ["rope"]);
});

test("a refused load and a lost connection leave nothing waiting", () => {
  const { simulation, loader, names, answer } = open();
  loader.load("rope");
  answer("rejected");
  assert.equal(loader.requested, null);
  loader.load("flag");
  loader.load("web");
  simulation.emit("connection", undefined);
  loader.load("curtain");
  assert.deepEqual(names(), ["rope", "flag", "curtain"]);
});
