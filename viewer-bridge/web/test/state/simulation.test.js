// The state of the simulation: epochs, tears, pins, resets, the ground, and the first view.

import assert from "node:assert/strict";
import { test } from "node:test";
import { firstViewBox, heldBox } from "../../js/state/framing.js";
import { Simulation } from "../../js/state/simulation.js";

const scene = (epoch, rest = {}) => ({
  kind: "scene", epoch, step: 0, particleCount: 2, constraintCount: 1, triangleCount: 0, isPlanar: false, up: "y",
  positions: Float32Array.from([0, 1, 0, 0, 0, 0]), ends: Uint32Array.from([0, 1]), restLengths: Float32Array.from([1]),
  triangles: new Uint32Array(0), constraintKinds: new Uint8Array(1), min: [0, 0, 0], max: [0, 1, 0], name: "two", meshes: new Map(), ...rest,
});
const frame = (epoch, number, rest = {}) => ({
  kind: "frame", epoch, step: number, number, particleCount: 2, lo: [0, 0, 0], scale: [1, 1, 1],
  positions: Float32Array.from([0, 1, 0, 0, 0.5, 0]), nonFinite: new Uint32Array(0), ...rest,
});
const tear = (epoch, first, ...constraints) => ({ kind: "tear", epoch, first, constraints: Uint32Array.from(constraints), causes: new Uint8Array(constraints.length) });

test("a frame of another epoch is not shown, but can be acknowledged", () => {
  const simulation = new Simulation();
  simulation.receive(scene(7));
  simulation.receive(frame(6, 41));
  assert.equal(simulation.frame, null);
  assert.equal(simulation.frameNumber, 41);
  simulation.receive(frame(7, 42));
  assert.deepEqual(simulation.position(1), [0, 0.5, 0]);
  assert.equal(simulation.position(2), null);
});

test("a list of tears is truncated and continued, and an empty one restores everything", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive(tear(1, 0, 0));
  assert.deepEqual([simulation.torn, simulation.topology.isGone[0]], [[0], 1]);
  simulation.receive(tear(1, 0));
  assert.deepEqual([simulation.torn, simulation.topology.isGone[0]], [[], 0]);
});

test("a live bridge at the address of a replay removes the recording", () => {
  const simulation = new Simulation();
  simulation.receiveText({ type: "hello", mode: "replay" });
  simulation.receiveText({ type: "timeline", marks: [] });
  simulation.receiveText({ type: "playback", is_playing: false });
  const events = [];
  for (const topic of ["timeline", "playback"]) simulation.on(topic, (value) => events.push([topic, value]));
  simulation.receiveText({ type: "hello", mode: "live" });
  assert.deepEqual([simulation.timeline, simulation.playback, simulation.isPaused], [null, null, false]);
  assert.deepEqual(events, [["timeline", null], ["playback", null]]);
});

test("a list of tears can have a million entries", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  const count = 1_000_000;
  simulation.receive({ kind: "tear", epoch: 1, first: 0, constraints: new Uint32Array(count), causes: new Uint8Array(count) });
  assert.equal(simulation.torn.length, count);
});

test("a reset reverts cuts and pins that were expected but never published", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1, { constraintCount: 2, ends: Uint32Array.of(0, 1, 1, 0), restLengths: Float32Array.of(1, 1), constraintKinds: new Uint8Array(2) }));
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  simulation.receive(tear(1, 0, 0));
  simulation.expectCut(1, [1]);
  simulation.expectPin(0, false);
  simulation.expectPin(1, true);
  assert.deepEqual([[...simulation.topology.isGone], [...simulation.pins]], [[1, 1], [[1, 1]]]);
  const events = [];
  for (const topic of ["tear", "pins", "reset"]) simulation.on(topic, () => events.push(topic));
  simulation.receiveText({ type: "reset", step: 0 });
  assert.deepEqual([[...simulation.topology.isGone], [...simulation.pins]], [[1, 0], [[0, 1]]]);
  assert.deepEqual(events.sort(), ["pins", "reset", "tear"], "listeners are notified");
});

test("constraints of a non-finite particle are hidden, and return with it", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive(frame(1, 1, { nonFinite: Uint32Array.of(1) }));
  assert.equal(simulation.topology.isGone[0], 1);
  simulation.receive(frame(1, 2));
  assert.equal(simulation.topology.isGone[0], 0);
});

test("a new scene clears tears and pins", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  simulation.receive(tear(1, 0, 0));
  simulation.receive(scene(2));
  assert.deepEqual([simulation.torn, simulation.pins.size, simulation.frame], [[], 0, null]);
});

test("a floor is drawn only if it holds, and the first view has room for what hangs", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  assert.equal(simulation.ground, null);
  assert.ok(simulation.lowest <= 0 && firstViewBox(simulation).min[1] <= simulation.lowest);
  simulation.receive({ kind: "colliders", epoch: 1, colliders: [{ shape: "plane", normal: [0, 1, 0], offset: -2 }] });
  assert.equal(simulation.ground.offset, -2);
});

test("the first view has room around a point, for a floor below, and for anchored motion", () => {
  const point = new Simulation();
  point.receive(scene(1, { particleCount: 1, constraintCount: 0, positions: Float32Array.of(1, 2, 3), min: [1, 2, 3], max: [1, 2, 3] }));
  assert.deepEqual(firstViewBox(point), { min: [0.5, 1.5, 2.5], max: [1.5, 2.5, 3.5] });
  const plane = new Simulation();
  plane.receive(scene(1, { isPlanar: true }));
  const before = firstViewBox(plane);
  plane.receive({ kind: "colliders", epoch: 1, colliders: [{ shape: "plane", normal: [0, 1, 0], offset: before.min[1] - 1 }] });
  assert.equal(firstViewBox(plane).min[1], before.min[1] - 1);
  const carried = new Simulation();
  carried.receive(scene(1));
  carried.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0, 1), flags: Uint32Array.of(4, 4) });
  assert.ok(firstViewBox(carried).max[0] > carried.box().max[0]);
});

test("the view ignores parts that were cut off and have fallen away", () => {
  const rope = { particleCount: 4, constraintCount: 3, positions: Float32Array.of(0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0), ends: Uint32Array.of(0, 1, 1, 2, 2, 3), restLengths: Float32Array.of(1, 1, 1), constraintKinds: new Uint8Array(3) };
  const fallen = Float32Array.of(0, 0, 0, 1, 0, 0, 2, -900, 0, 3, -900, 0);
  const simulation = new Simulation();
  simulation.receive(scene(1, rope));
  simulation.receive({ ...frame(1, 1), particleCount: 4, positions: fallen });
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  assert.equal(heldBox(simulation).min[1], -900, "a stretched part is no fallen one");
  simulation.receive(tear(1, 0, 1));
  assert.deepEqual(heldBox(simulation), { min: [0, 0, 0], max: [1, 0, 0] });
  // Without anything that holds, the largest part is the scene.
  simulation.receive({ kind: "pins", epoch: 1, particles: new Uint32Array(0), flags: new Uint32Array(0) });
  simulation.receive(tear(1, 1, 2));
  assert.deepEqual(heldBox(simulation), { min: [0, 0, 0], max: [1, 0, 0] });
});
