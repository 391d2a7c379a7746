// Picking with a camera whose pixels are known in closed form.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera, sceneAxes } from "../js/geometry/camera.js";
import { crossedSticks, pickParticle, projectAll, segmentsCross } from "../js/geometry/pick.js";

const VIEWPORT = { width: 800, height: 600 };
const camera = Object.assign(new Camera(), { yaw: 0, pitch: 0, distance: 5 });
const frame = (positions) => ({ positions: Float32Array.from(positions), lo: [0, 0, 0], scale: [1, 1, 1] });
const pick = (points, at, radius = 18) => pickParticle(points, camera.viewProjection(VIEWPORT), VIEWPORT, at, radius);

test("the nearest particle within the radius is picked, and none outside it", () => {
  const points = frame([0, 0, 0, 0.05, 0, 0, 1, 1, 0]);
  const at = camera.project([0.04, 0, 0], VIEWPORT);
  assert.equal(pick(points, at), 1);
  assert.equal(pick(points, { x: 10, y: 10 }), null);
});

test("the front one of two layers is picked, although the other is nearer to the pixel", () => {
  const at = camera.project([0, 0, 0], VIEWPORT);
  assert.equal(pick(frame([0, 0, -2, 0.01, 0.01, 1]), at), 1);
});

test("a particle behind the eye is not picked", () => {
  assert.equal(pick(frame([0, 0, 9]), { x: 400, y: 300 }, 1000), null);
});

test("quantised positions are picked like the positions that they encode", () => {
  const positions = Uint16Array.from([0, 0, 0, 65535, 32768, 0]);
  const points = { positions, lo: [-1, -0.5, 0], scale: [2 / 65535, 1 / 65535, 0] };
  assert.equal(pick(points, camera.project([1, 0, 0], VIEWPORT)), 1);
  const pixels = projectAll(points, camera.viewProjection(VIEWPORT), VIEWPORT);
  const expected = camera.project([-1, -0.5, 0], VIEWPORT);
  assert.ok(Math.abs(pixels[0] - expected.x) < 1e-3 && Math.abs(pixels[1] - expected.y) < 1e-3);
});

const flat = Object.assign(new Camera(), { isFlat: true, axes: sceneAxes("y", 2) });
const on = (x, y) => flat.project([x, y, 0], VIEWPORT);
/** A ladder: rungs at heights 0, 1, 2, 3 between x = -1 and x = 1, or higher. */
const ladder = (height = 0) => {
  const points = frame([0, 1, 2, 3].flatMap((y) => [-1, y + height, 0, 1, y + height, 0]));
  return projectAll(points, flat.viewProjection(VIEWPORT), VIEWPORT);
};
const RUNGS = Uint32Array.from([0, 1, 2, 3, 4, 5, 6, 7]);
const cut = (pixels, past, path, isGone = [0, 0, 0, 0]) => crossedSticks(pixels, past, RUNGS, Uint8Array.from(isGone), path);

test("a stroke crosses the intact sticks on its path", () => {
  const path = [on(0, -0.5), on(0.2, 2.5)];
  assert.deepEqual(cut(ladder(), ladder(), path), [0, 1, 2]);
  assert.deepEqual(cut(ladder(), ladder(), path, [0, 1, 0, 0]), [0, 2]);
});

test("a stroke follows every point of its path", () => {
  // Around the end of rung 1, not through it.
  assert.deepEqual(cut(ladder(), ladder(), [on(0, 0.5), on(1.5, 0.5), on(1.5, 1.5), on(0, 1.5)]), []);
  assert.deepEqual(cut(ladder(), ladder(), [on(0, 0.5), on(0, 1.5)]), [1]);
});

test("a stick that moves over the blade is cut, wherever the stroke continues", () => {
  const past = ladder(0.25);
  assert.deepEqual(cut(ladder(-0.25), past, [on(0, 1)]), [1]);
  assert.deepEqual(cut(ladder(-0.25), past, [on(0, 1), on(0, 1.5)]), [1], "the stick has already passed the blade");
  assert.deepEqual(cut(ladder(-0.25), past, [on(0, 0.5)]), [], "no stick passed there");
  assert.deepEqual(cut(ladder(-0.25), past, [on(2, 1)]), [], "beside the ladder");
});

test("segments cross if each has its ends on both sides of the other", () => {
  const from = { x: 0, y: 0 };
  const to = { x: 2, y: 2 };
  assert.ok(segmentsCross(0, 2, 2, 0, from, to));
  // A stroke that ends on a stick crosses it at once, or when it goes on: exactly once.
  const beyond = { x: 4, y: 3 };
  assert.notEqual(segmentsCross(2, 0, 2, 4, from, to), segmentsCross(2, 0, 2, 4, to, beyond));
  assert.ok(!segmentsCross(0, 2, 0.9, 1.1, from, to), "too short");
  assert.ok(!segmentsCross(1, 0, 3, 2, from, to), "parallel");
  assert.ok(!segmentsCross(0.5, 0.5, 1, 1, from, to), "on the same line");
  assert.ok(!segmentsCross(NaN, NaN, 1, 1, from, to), "behind the eye");
});
