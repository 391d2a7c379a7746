// A link shows its pose where its scene is on show, and asks before it replaces another scene.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Simulation } from "../../js/state/simulation.js";
import { followLink, parseLink } from "../../js/view/link.js";

const scene = {
  kind: "scene", epoch: 1, step: 0, particleCount: 0, constraintCount: 0, triangleCount: 0, isPlanar: false, min: [0, 0, 0], max: [1, 1, 1],
  positions: new Float32Array(0), ends: new Uint32Array(0), restLengths: new Float32Array(0), triangles: new Uint32Array(0),
  constraintKinds: new Uint8Array(0), name: "curtain", unit: "m", up: "y", shapes: [], meshes: new Map(),
};
const hello = (mode) => ({ type: "hello", mode, scenes: [{ name: "curtain" }, { name: "rope" }] });
const node = (state) => ({ type: "node", state, is_replay: false });

/** Opens a link, and returns the simulation and the log of what the page does for it. */
function open(hash, mode = "live") {
  const simulation = new Simulation();
  const log = [];
  followLink(parseLink(hash), simulation, {
    show: (pose) => log.push(["show", pose?.distance ?? null]),
    ask: (wanted, present) => log.push(["ask", wanted, present]),
    miss: (wanted) => log.push(["miss", wanted]),
  });
  simulation.setConnected(true);
  simulation.receiveText(hello(mode));
  return { simulation, log };
}

/** The log after the page has received a node and its scene. */
function followed(hash, mode) {
  const { simulation, log } = open(hash, mode);
  simulation.receiveText(node("alive"));
  simulation.receive(scene);
  // Later scenes are of no concern to the link.
  simulation.receive({ ...scene, epoch: 2, name: "rope" });
  return log;
}

test("a link is followed once, and asks only for another scene that the viewer has", () => {
  assert.deepEqual(followed("camera=0,1,0,5,0,0"), [["show", 5]]);
  assert.deepEqual(followed("scene=curtain"), [["show", null]]);
  assert.deepEqual(followed("scene=rope"), [["ask", "rope", "curtain"]]);
  assert.deepEqual(followed("scene=nonsense"), [["miss", "nonsense"]]);
  assert.deepEqual(followed("scene=rope", "replay"), [["show", null]], "a recording has one scene");
});

test("a link to another scene waits until its node is known to run", () => {
  const { simulation, log } = open("scene=rope");
  simulation.receiveText(node("none"));
  simulation.receive(scene);
  assert.deepEqual(log, []);
  simulation.receiveText(node("alive"));
  assert.deepEqual(log, [["ask", "rope", "curtain"]]);
});
