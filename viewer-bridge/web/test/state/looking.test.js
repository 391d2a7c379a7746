// Looking back: an earlier state on show, while the present goes on unseen.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Simulation } from "../../js/state/simulation.js";

const scene = (epoch) => ({
  kind: "scene", epoch, step: 0, particleCount: 2, constraintCount: 2, triangleCount: 0, isPlanar: false, up: "y", rateHz: 60,
  positions: Float32Array.from([0, 1, 0, 0, 0, 0]), ends: Uint32Array.from([0, 1, 1, 0]), restLengths: Float32Array.from([1, 1]),
  triangles: new Uint32Array(0), constraintKinds: new Uint8Array(2), min: [0, 0, 0], max: [0, 1, 0], name: "two", meshes: new Map(),
});
const frame = (epoch, step, y) => ({
  kind: "frame", epoch, step, number: step, particleCount: 2, lo: [0, 0, 0], scale: [1, 1, 1],
  positions: Float32Array.from([0, 1, 0, 0, y, 0]), nonFinite: new Uint32Array(0),
});
const tear = (epoch, first, ...constraints) => ({ kind: "tear", epoch, step: 0, first, constraints: Uint32Array.from(constraints), causes: Uint8Array.from(constraints, () => 3) });
const pins = (epoch, ...particles) => ({ kind: "pins", epoch, step: 0, particles: Uint32Array.from(particles), flags: Uint32Array.from(particles.map(() => 1)) });
const ball = (radius) => ({ kind: "colliders", epoch: 1, step: 0, colliders: [{ shape: "sphere", radius }] });

/** The present is step 100: constraint 0 is torn, particle 0 is pinned. */
function present() {
  const simulation = new Simulation();
  for (const message of [scene(1), tear(1, 0, 0), pins(1, 0), ball(1), frame(1, 100, 0.5)]) simulation.receive(message);
  simulation.frameNumber = null;
  return simulation;
}

/** Shows step 40, at which nothing was torn and particle 1 was pinned. */
function lookBack(simulation, epoch = 1, step = 40) {
  const parts = [tear(epoch, 0), pins(epoch, 1), ball(2), frame(epoch, step, 0.1)];
  simulation.receive({ kind: "past", epoch, step, count: parts.length });
  for (const part of parts) simulation.receive(part);
}

const shown = ({ frame: { step, positions }, torn, pins: held, colliders, topology }) => ({
  step, y: positions[4], torn: [...torn], pins: [...held.keys()], radius: colliders[0].radius, gone: [...topology.isGone],
});
const FUZZ = Math.fround(0.1);

test("an earlier state is shown with its own tears, pins and colliders, and is not acknowledged", () => {
  const simulation = present();
  lookBack(simulation);
  assert.deepEqual(shown(simulation), { step: 40, y: FUZZ, torn: [], pins: [1], radius: 2, gone: [0, 0] });
  assert.deepEqual([simulation.isLookingBack, simulation.present.step, simulation.frameNumber], [true, 100, null]);
});

test("the present goes on unseen, is acknowledged, and is whole on return", () => {
  const simulation = present();
  lookBack(simulation);
  const news = [];
  simulation.on("present", ({ step }) => news.push(step));
  for (const message of [tear(1, 1, 1), pins(1), ball(3), frame(1, 101, 0.6)]) simulation.receive(message);
  assert.deepEqual(shown(simulation), { step: 40, y: FUZZ, torn: [], pins: [1], radius: 2, gone: [0, 0] });
  assert.deepEqual([news, simulation.frameNumber], [[101], 101]);
  // Another look replaces the state on show, and not the present.
  lookBack(simulation, 1, 30);
  assert.equal(simulation.frame.step, 30);
  simulation.returnToPresent();
  assert.deepEqual(shown(simulation), { step: 101, y: Math.fround(0.6), torn: [0, 1], pins: [], radius: 3, gone: [1, 1] });
  assert.equal(simulation.isLookingBack, false);
});

test("after a rewind the page returns with the step that shows it, and not before", () => {
  const simulation = present();
  lookBack(simulation);
  simulation.returnAt(103);
  simulation.receive(frame(1, 102, 0.7));
  assert.equal(simulation.frame.step, 40);
  // A look that was under way must not hide the state.
  lookBack(simulation, 1, 20);
  assert.equal(simulation.frame.step, 40);
  simulation.receive(frame(1, 103, 0.1));
  assert.deepEqual([simulation.frame.step, simulation.isLookingBack], [103, false]);
});

test("another scene ends the look, and a state of the scene before it is dropped", () => {
  const simulation = present();
  lookBack(simulation);
  const events = [];
  simulation.on("past", (step) => events.push(step));
  simulation.receive(scene(2));
  assert.deepEqual([simulation.isLookingBack, events], [false, [null]]);
  simulation.receive(frame(2, 1, 0.9));
  lookBack(simulation, 1, 40);
  assert.deepEqual([simulation.frame.step, simulation.isLookingBack, simulation.torn], [1, false, []]);
});

test("a reset of the present leaves the earlier state on show", () => {
  const simulation = present();
  lookBack(simulation);
  simulation.receiveText({ type: "reset", step: 101 });
  assert.deepEqual(shown(simulation), { step: 40, y: FUZZ, torn: [], pins: [1], radius: 2, gone: [0, 0] });
});

test("a cut in a pause is still drawn after a look, and a new step replaces the expectation", () => {
  const simulation = present();
  simulation.expectCut(1, [1]);
  assert.deepEqual([...simulation.topology.isGone], [1, 1]);
  lookBack(simulation);
  assert.deepEqual([...simulation.topology.isGone], [0, 0]);
  simulation.returnToPresent();
  assert.deepEqual([...simulation.topology.isGone], [1, 1]);
  simulation.receive(frame(1, 101, 0.5));
  simulation.rebuild();
  assert.deepEqual([...simulation.topology.isGone], [1, 0]);
});
