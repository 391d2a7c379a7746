// Forces as arrows: where they begin, what they add up to, and the scale of their lengths.

import assert from "node:assert/strict";
import { test } from "node:test";
import { niceFloor } from "../../js/geometry/math.js";
import { ForceScale, arrowsOf } from "../../js/state/forces.js";
import { Simulation } from "../../js/state/simulation.js";

const collider = (index, shape, rest) => ({
  index, shape, restitution: 0, friction: 0, radius: 0.5, offset: 0, normal: [0, 1, 0], center: [0, 0, 0], halfExtents: [1, 1, 1],
  rotation: [0, 0, 0, 1], a: [0, 0, 0], b: [0, 0, 0], velocity: [0, 0, 0], angularVelocity: [0, 0, 0], ...rest,
});
const row = (kind, index, impulse) => ({ kind, index, impulse, angularImpulse: [0, 0, 0], contacts: 0 });
const forces = (step, ...rows) => ({ kind: "forces", epoch: 1, step, rateHz: 100, rows });
const frame = (step) => ({
  kind: "frame", epoch: 1, step, number: step, particleCount: 2, lo: [0, 0, 0], scale: [1, 1, 1],
  positions: Float32Array.from([0, 1, 0, 2, 3, 4]), nonFinite: new Uint32Array(0),
});

function simulationWith(...colliders) {
  const simulation = new Simulation();
  simulation.receive({
    kind: "scene", epoch: 1, step: 0, particleCount: 2, constraintCount: 0, triangleCount: 0, isPlanar: false, min: [0, 0, 0], max: [1, 1, 1],
    positions: new Float32Array(6), ends: new Uint32Array(0), restLengths: new Float32Array(0), triangles: new Uint32Array(0),
    constraintKinds: new Uint8Array(0), name: "", up: "y", meshes: new Map(),
  });
  simulation.receive({ kind: "colliders", epoch: 1, step: 0, colliders });
  return simulation;
}

test("forces are shown with the frame of their step, and only with it", () => {
  const simulation = simulationWith();
  simulation.receive(frame(1));
  simulation.receive(forces(2, row("particle", 1, [0, -0.5, 0])));
  assert.deepEqual(arrowsOf(simulation), [], "their frame has not arrived");
  simulation.receive(frame(2));
  assert.deepEqual(arrowsOf(simulation), [{ kind: "particle", index: 1, from: [2, 3, 4], force: [0, -50, 0] }]);
  simulation.receive(frame(3));
  assert.deepEqual(arrowsOf(simulation), [], "that frame came without forces");
});

test("an arrow begins at the particle or in the middle of the collider, and anchors have none", () => {
  const simulation = simulationWith(
    collider(0, "sphere", { center: [1, 2, 3] }), collider(1, "capsule", { a: [0, 0, 0], b: [2, 0, 0] }),
    collider(2, "plane", { normal: [0, 1, 0], offset: -1 }), collider(4, "box", {}),
  );
  const push = [0, 0.01, 0];
  simulation.receive(forces(1, ...[0, 1, 2, 3].map((index) => row("collider", index, push)), row("collider", 4, [0, 0, 0]), row("anchor", 0, push), row("particle", 0, push), row("particle", 9, push)));
  simulation.receive(frame(1));
  const arrows = arrowsOf(simulation);
  assert.deepEqual(arrows.map(({ kind, index }) => [kind, index]), [["collider", 0], ["collider", 1], ["collider", 2], ["particle", 0]]);
  assert.deepEqual(arrows.map(({ from }) => from), [[1, 2, 3], [1, 0, 0], [1, -1, 2], [0, 1, 0]]);
  for (const { force } of arrows) assert.deepEqual(force, [0, 1, 0]);
});

test("lengths are proportional to forces, and the scale is a round number that changes seldom", () => {
  const scale = new ForceScale();
  const arrow = (newtons) => ({ kind: "particle", index: 0, from: [0, 0, 0], force: [0, newtons, 0] });
  assert.equal(scale.unitsPerNewton(2), 0);
  scale.follow([arrow(1), arrow(-4.2)]);
  assert.deepEqual([scale.end, scale.unitsPerNewton(2)], [5, 0.2]);
  scale.follow([arrow(1.6)]);
  scale.follow([]);
  assert.equal(scale.end, 5);
  scale.follow([arrow(1.4)]);
  assert.equal(scale.end, 2);
  scale.follow([arrow(70)]);
  assert.equal(scale.end, 100);
});

test("the legend has 1, 2 or 5 times a power of ten", () => {
  assert.deepEqual([0.03, 1, 1.99, 4.2, 5, 99, 1e-7].map(niceFloor), [0.02, 1, 1, 2, 5, 50, 1e-7]);
});
