// When the view follows a scene that has settled.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "../../js/geometry/camera.js";
import { Settling, Watch, between, isWorthwhile } from "../../js/view/settling.js";

const framing = (distance, ...target) => ({ distance, target });

/** A scene whose particles lie in a cube of a size around a point. */
function scene(at, size, rest = {}) {
  const position = (half) => at.map((one) => one + half * size);
  const simulation = {
    isReplay: false, isLookingBack: false, pins: new Map(), colliders: [], torn: [], ghost: null,
    scene: {}, topology: {}, frame: { simTime: 0 }, box: () => ({ min: position(-0.5), max: position(0.5) }), ...rest,
  };
  const app = { simulation, camera: new Camera(), renderer: { viewport: { width: 100, height: 100 }, isDirty: false } };
  const input = { touches: 0 };
  const settling = new Settling(app, input);
  app.camera.frame({ min: [-1, -1, -1], max: [1, 1, 1] }, 1);
  settling.begin(true);
  const until = (/** @type {number} */ endS) => {
    for (; simulation.frame.simTime < endS; simulation.frame.simTime += 1 / 60) settling.follow();
  };
  return { app, input, settling, until };
}

globalThis.matchMedia = /** @type {any} */ (() => ({ matches: false }));

test("the view glides to a scene that has become smaller, and rests on it", () => {
  const { app, settling, until } = scene([0, -0.8, 0], 0.4);
  const { distance } = app.camera;
  until(3.9);
  settling.tick(0);
  assert.equal(app.camera.distance, distance);
  until(4.1);
  for (const ms of [1000, 1450, 1900]) settling.tick(ms);
  assert.deepEqual(app.camera.target, [0, -0.8, 0]);
  assert.ok(app.camera.distance < distance / 2);
  assert.ok(settling.isOwn());
  const fitted = app.camera.distance;
  until(12);
  settling.tick(3000);
  assert.equal(app.camera.distance, fitted);
});

test("a view or a scene that the user has touched stays, and so does one that anchors move", () => {
  for (const touch of [
    ({ input }) => { input.touches += 1; },
    ({ app }) => { app.camera.distance *= 1.01; },
    ({ app, settling }) => { app.simulation.pins.set(0, 4); settling.begin(true); },
    ({ app, settling }) => { app.simulation.isReplay = true; settling.begin(true); },
    ({ settling }) => settling.begin(false),
  ]) {
    const rig = scene([0, -0.8, 0], 0.4);
    rig.until(1);
    touch(rig);
    const { distance } = rig.app.camera;
    rig.until(12);
    rig.settling.tick(0);
    rig.settling.tick(5000);
    assert.equal(rig.app.camera.distance, distance);
  }
});

test("a glide ends where the user takes over", () => {
  const { app, settling, until } = scene([0, -0.8, 0], 0.4);
  until(4.1);
  settling.tick(0);
  settling.tick(300);
  app.camera.distance *= 2;
  const { distance } = app.camera;
  settling.tick(600);
  assert.equal(app.camera.distance, distance);
  assert.equal(settling.isOwn(), false);
});

test("a scene that swings has not settled", () => {
  const watch = new Watch();
  for (const x of [-1, 0, 1]) watch.add({ min: [x, 0, 0], max: [x + 1, 1, 1] }, 0);
  assert.deepEqual(watch.union, { min: [-1, 0, 0], max: [2, 1, 1] });
  assert.equal(watch.isSettled, false);
  const still = new Watch();
  still.add({ min: [0, 0, 0], max: [1, 1, 1] }, 0);
  still.add({ min: [0.05, 0, 0], max: [1.05, 1, 1] }, 0.1);
  assert.ok(still.isSettled);
});

test("small changes are not worth a motion, and what flies away is not followed", () => {
  const now = framing(10, 0, 0, 0);
  assert.equal(isWorthwhile(now, framing(9.5, 0.3, 0, 0), true), false);
  assert.equal(isWorthwhile(now, framing(6, 0, 0, 0), true), true);
  assert.equal(isWorthwhile(now, framing(6, 0, 0, 0), false), false);
  assert.equal(isWorthwhile(now, framing(10, 2, 0, 0), true), true);
  assert.equal(isWorthwhile(now, framing(14, 0, 0, 0), false), true);
  assert.equal(isWorthwhile(now, framing(100, 0, 0, 0), false), false);
});

test("a glide begins and ends where it should, and slowly", () => {
  const [from, to] = [framing(1, 0, 0, 0), framing(4, 2, 0, 0)];
  assert.deepEqual([between(from, to, 0), between(from, to, 1)], [from, to]);
  assert.deepEqual(between(from, to, 0.5), framing(2, 1, 0, 0));
  assert.ok(between(from, to, 0.1).target[0] < 0.1);
});
