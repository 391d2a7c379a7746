// What the particles of a scene stand for: planks and ropes of a bridge, limbs, and the poles of flags.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bodyRadii, bridgeRopes, bridgeTriangles, planksOf, polesOf } from "../../js/state/shapes.js";
import { firstViewBox, fittedBox } from "../../js/state/framing.js";
import { Simulation } from "../../js/state/simulation.js";

/** A particle, then a bridge of three planks as the node generates it. */
const BRIDGE = {
  particleCount: 7, constraintCount: 11, triangleCount: 4, isPlanar: false, up: "y", shapes: [{ shape: "bridge", first: 1, count: 6 }],
  ends: Uint32Array.of(1, 2, 1, 3, 2, 4, 1, 4, 2, 3, 3, 4, 3, 5, 4, 6, 3, 6, 4, 5, 5, 6),
  constraintKinds: Uint8Array.of(0, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0), restLengths: Float32Array.of(2, 1, 1, 2.2, 2.2, 2, 1, 1, 2.2, 2.2, 2),
  triangles: Uint32Array.of(1, 2, 4, 1, 4, 3, 3, 4, 6, 3, 6, 5),
};

test("the planks of a bridge join its left and right particles, and its ropes the planks", () => {
  assert.deepEqual(planksOf(BRIDGE), [
    { left: 1, right: 2, before: 1, after: 3, constraint: 0 },
    { left: 3, right: 4, before: 1, after: 5, constraint: 5 },
    { left: 5, right: 6, before: 3, after: 5, constraint: 10 },
  ]);
  assert.deepEqual(bridgeRopes(BRIDGE), [1, 2, 6, 7]);
  assert.deepEqual([...bridgeTriangles(BRIDGE)], [1, 1, 1, 1]);
});

test("a scene that names no bridge has neither planks nor hidden triangles", () => {
  const plain = { ...BRIDGE, shapes: [{ shape: "cloth", first: 1, count: 6 }] };
  assert.deepEqual([planksOf(plain), bridgeRopes(plain), [...bridgeTriangles(plain)]], [[], [], [0, 0, 0, 0]]);
  assert.deepEqual([...bodyRadii(plain, { contact: 0.1, sceneRadius: 1 })], new Array(11).fill(0));
});

test("a rope is as thick as the distance that it keeps, and the ropes of a bridge are thinner than a plank", () => {
  const rope = { particleCount: 3, constraintCount: 2, ends: Uint32Array.of(0, 1, 1, 2), restLengths: Float32Array.of(0.1, 0.1), constraintKinds: new Uint8Array(2), shapes: [{ shape: "rope", first: 0, count: 3 }] };
  assert.deepEqual([...bodyRadii(rope, { contact: 0.25, sceneRadius: 1 })], [0.125, 0.125]);
  const [free] = bodyRadii(rope, { contact: null, sceneRadius: 1 });
  assert.ok(free > 0 && free < 0.05);
  const radii = bodyRadii(BRIDGE, { contact: null, sceneRadius: 1 });
  assert.ok(radii[1] > 0 && radii[1] < 0.2 && radii[1] === radii[7]);
  assert.deepEqual([0, 3, 5].map((one) => radii[one]), [0, 0, 0]);
});

test("the limbs of a figure grow with it, and its braces stay lines", () => {
  const constraintCount = 20;
  const figure = (height) => ({
    particleCount: 15, constraintCount, constraintKinds: new Uint8Array(constraintCount), shapes: [{ shape: "ragdoll", first: 0, count: 15 }],
    ends: Uint32Array.from({ length: 2 * constraintCount }, (_, k) => k % 15), restLengths: new Float32Array(constraintCount).fill(0.32 * height),
  });
  const [small, tall] = [1, 2].map((height) => bodyRadii(figure(height), { contact: null, sceneRadius: 1 }));
  assert.ok(small[7] > small[4] && small[4] > 0.01, "the trunk is thicker than a forearm");
  for (const limb of [0, 7, 13]) assert.ok(Math.abs(tall[limb] / small[limb] - 2) < 1e-6);
  assert.deepEqual([...small.subarray(14)], [0, 0, 0, 0, 0, 0]);
});

/** A sheet of 3 x 3 particles in the x-y plane, with these pins. */
function sheet(pins, flags = 1) {
  const simulation = new Simulation();
  const positions = Float32Array.from({ length: 27 }, (_, k) => [(Math.floor(k / 3) % 3) * 0.5, 2 - Math.floor(k / 9) * 0.5, 0][k % 3]);
  const corners = [0, 1, 3, 4].flatMap((p) => [p, p + 3, p + 4, p, p + 4, p + 1]);
  simulation.receive({
    kind: "scene", epoch: 1, step: 0, particleCount: 9, constraintCount: 0, triangleCount: 8, isPlanar: false, up: "y", positions, ends: new Uint32Array(0),
    restLengths: new Float32Array(0), triangles: Uint32Array.from(corners), constraintKinds: new Uint8Array(0), min: [0, 1, 0], max: [1, 2, 0], name: "sheet", meshes: new Map(), shapes: [],
  });
  simulation.receive({ kind: "frame", epoch: 1, step: 1, number: 1, particleCount: 9, lo: [0, 0, 0], scale: [1, 1, 1], positions, nonFinite: new Uint32Array(0) });
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.from(pins), flags: new Uint32Array(pins.length).fill(flags) });
  return simulation;
}

test("a vertical line of pinned particles of a sheet has a pole, down to the ground", () => {
  const simulation = sheet([0, 3, 6]);
  const [pole, ...others] = polesOf(simulation);
  assert.equal(others.length, 0);
  assert.deepEqual([pole.top[0], pole.top[2], pole.foot[0], pole.foot[2]], [0, 0, 0, 0]);
  assert.ok(pole.top[1] > 2 && pole.foot[1] < 1 && pole.radius > 0);
  simulation.receive({ kind: "colliders", epoch: 1, colliders: [{ shape: "plane", normal: [0, 1, 0], offset: 0.5 }] });
  assert.equal(polesOf(simulation)[0].foot[1], 0.5);
});

test("other pins have no pole: a horizontal line, two of a column, and particles that an anchor moves", () => {
  for (const simulation of [sheet([0, 1, 2]), sheet([0, 3]), sheet([0, 3, 6], 4), sheet([])]) assert.deepEqual(polesOf(simulation), []);
});

test("the first view of a flag has no room for hanging while the wind blows", () => {
  const simulation = sheet([0, 3, 6]);
  simulation.lowest = -1;
  assert.equal(firstViewBox(simulation).min[1], -1);
  simulation.parameters = { initial: { "wind.velocity": [5, 0, 0] } };
  assert.ok(firstViewBox(simulation).min[1] > 0.9);
  // A curtain in the wind still hangs.
  const curtain = sheet([0, 1, 2]);
  curtain.lowest = -1;
  curtain.parameters = simulation.parameters;
  assert.equal(firstViewBox(curtain).min[1], -1);
});

test("a fitted view is filled by the scene as it is now", () => {
  const simulation = sheet([0, 1, 2]);
  simulation.lowest = -1;
  assert.deepEqual(fittedBox(simulation), { min: [0, 1, 0], max: [1, 2, 0] });
  simulation.receive({ kind: "colliders", epoch: 1, colliders: [{ shape: "sphere", center: [1, 1, 0], radius: 0.5 }] });
  assert.deepEqual(fittedBox(simulation), { min: [0, 0.5, -0.5], max: [1.5, 2, 0.5] });
});
