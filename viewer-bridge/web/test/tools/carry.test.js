// Carrying and throwing colliders and anchors.

import assert from "node:assert/strict";
import { test } from "node:test";
import { add, length, scale, subtract } from "../../js/geometry/math.js";
import { PIN } from "../../js/net/wire.js";
import { VIEWPORT, pageOf, sceneOf } from "./page.js";

const NO_ROTATION = [0, 0, 0, 1];
const SPHERE = { index: 0, shape: "sphere", center: [0, 0, 0], radius: 0.4 };
const BOX = { index: 0, shape: "box", center: [0, 0, 0], halfExtents: [0.3, 0.3, 0.3], rotation: NO_ROTATION };
const CAPSULE = { index: 0, shape: "capsule", a: [0, -0.4, 0], b: [0, 0.4, 0], radius: 0.3 };
const MESH = { index: 0, shape: "mesh", center: [0, 0, 0], rotation: NO_ROTATION };
/** A square that faces the first view, for a mesh. */
const SQUARE = { vertices: Float32Array.from([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0].map((one) => one * 0.4)), triangles: Uint32Array.from([0, 1, 2, 0, 2, 3]) };
const FLOOR = { index: 1, shape: "plane", normal: [0, 1, 0], offset: -0.5 };
const BOUNDS = { index: 2, shape: "bounds", a: [-4, -4, -4], b: [4, 4, 4] };
/** Far from the middle of the picture. */
const FAR = [30, 30, 30];

/** A page that shows colliders, and no particle near the middle. */
function shown(colliders, { positions = FAR, canChange = true, ...change } = {}) {
  const page = pageOf(sceneOf(positions, change), canChange);
  page.simulation.receiveColliders(colliders);
  return page;
}

/** Sends an event of the mouse, by some pixels from the middle. */
function at({ listeners, event }, type, dx = 0, dy = 0, change = {}) {
  listeners.get(type)({ ...event, type, clientX: event.clientX + dx, clientY: event.clientY + dy, ...change });
}

const kinds = ({ sent }) => sent.map(({ kind }) => kind);
const isCarried = (page) => (at(page, "pointerdown"), page.input.tool.carried !== undefined);
const nearly = (value, expected, within = 1e-9) => assert.ok(length(subtract(value, expected)) < within, `${value} is not ${expected}`);

test("a drag on a solid carries it along with the pointer, once per frame", () => {
  for (const solid of [SPHERE, BOX, CAPSULE, MESH]) {
    const page = shown([FLOOR, { ...solid, index: 7 }], { meshes: new Map([[7, SQUARE]]) });
    const { yaw } = page.camera;
    at(page, "pointerdown");
    assert.deepEqual(page.sent, []);
    at(page, "pointermove", 20, 5);
    at(page, "pointermove", 40, 10);
    assert.deepEqual(page.sent.map(({ id, ...rest }) => rest), [{ kind: "lift", epoch: 1, object: "collider", index: 7 }]);
    const { tool } = page.input;
    page.input.tick(tool.sentMs + 20);
    page.input.tick(tool.sentMs + 20);
    assert.deepEqual(kinds(page), ["lift", "carry"], solid.shape);
    const { over_s, offset, ...rest } = page.sent[1];
    assert.deepEqual(rest, { kind: "carry", object: "collider", index: 7 });
    nearly([over_s, 0, 0], [0.02, 0, 0]);
    // The point that was pressed is under the pointer now.
    const pixel = page.camera.project(add(tool.from, offset), VIEWPORT);
    nearly([pixel.x, pixel.y, 0], [page.event.clientX + 40, page.event.clientY + 10, 0], 1e-6);
    nearly([page.camera.basis().back.reduce((sum, one, axis) => sum + one * offset[axis], 0), 0, 0], [0, 0, 0]);
    assert.equal(page.camera.yaw, yaw);
  }
});

test("a point in front moves less than the pointer's place at the target of the camera", () => {
  const page = shown([SPHERE]);
  at(page, "pointerdown");
  at(page, "pointermove", 100);
  page.input.tick(performance.now());
  const unit = page.camera.unitsPerPixel(page.input.tool.from, VIEWPORT);
  assert.ok(unit < page.camera.unitsPerPixel([0, 0, 0], VIEWPORT));
  nearly(page.sent[1].offset, scale(page.camera.basis().right, 100 * unit), 1e-6);
});

test("a throw has the velocity of the pointer, and none after a rest", (context) => {
  let ms = 1000;
  context.mock.method(performance, "now", () => ms);
  // Also of a motion that lasts longer than the velocity is measured over, which begins between two events.
  for (const [frames, rest] of [[7, 0], [7, 200], [30, 0]]) {
    const page = shown([SPHERE]);
    at(page, "pointerdown");
    for (let frame = 1; frame <= frames; frame++) {
      ms += 9;
      at(page, "pointermove", 0, -3 * frame);
      page.input.tick(ms);
    }
    ms += rest;
    page.input.tick(ms);
    const unit = page.camera.unitsPerPixel(page.input.tool.from, VIEWPORT);
    at(page, "pointerup", 0, -3 * frames);
    const { id, velocity, ...thrown } = page.sent[page.sent.length - 1];
    assert.deepEqual(thrown, { kind: "throw", object: "collider", index: 0 });
    // Three pixels in 9 ms.
    nearly(velocity, rest > 0 ? [0, 0, 0] : scale(page.camera.basis().up, (3000 / 9) * unit), 1e-6);
    assert.equal(kinds(page).filter((kind) => kind === "throw").length, 1);
    assert.equal(page.input.tool, null);
  }
});

test("a press that lasts carries, and a click on a solid sends nothing", () => {
  const page = shown([SPHERE]);
  at(page, "pointerdown");
  at(page, "pointerup");
  assert.deepEqual([page.sent, page.selection.items], [[], []]);
  at(page, "pointerdown");
  const { pressedMs } = page.input.tool;
  page.input.tick(pressedMs + 250);
  at(page, "pointerup", 0, 0, { timeStamp: pressedMs + 250 });
  assert.deepEqual(kinds(page), ["lift", "throw"]);
  assert.deepEqual(page.sent[1].velocity, [0, 0, 0]);
});

test("another scene, a reset and a lost connection end the carrying", () => {
  for (const change of [(page) => page.simulation.receiveText({ type: "reset", step: 2 }), (page) => page.simulation.receive(sceneOf(FAR, { epoch: 2 }))]) {
    const page = shown([SPHERE]);
    at(page, "pointerdown");
    at(page, "pointermove", 50);
    change(page);
    assert.deepEqual(kinds(page), ["lift", "throw"]);
    assert.deepEqual([page.sent[1].velocity, page.input.tool], [[0, 0, 0], null]);
  }
  const page = shown([SPHERE]);
  at(page, "pointerdown");
  at(page, "pointermove", 50);
  page.input.abandon();
  assert.deepEqual(kinds(page), ["lift"]);
});

test("nothing more is sent for an object that another page carries", () => {
  const page = shown([SPHERE]);
  at(page, "pointerdown");
  at(page, "pointermove", 50);
  page.commands.receive({ type: "outcome", id: page.sent[0].id, status: "rejected", reason: "grabbed_by_other" });
  page.input.tick(performance.now());
  at(page, "pointerup", 50);
  assert.deepEqual(kinds(page), ["lift"]);
});

test("planes and bounds are not carried, and dragging them turns the view", () => {
  const page = shown([FLOOR, BOUNDS]);
  const { yaw } = page.camera;
  at(page, "pointerdown", 0, 200);
  at(page, "pointermove", 50, 200);
  at(page, "pointerup", 50, 200);
  assert.notEqual(page.camera.yaw, yaw);
  assert.deepEqual(page.sent, []);
});

test("a solid behind the cloth or under the floor is not carried", () => {
  const { eye, basis } = (({ camera }) => ({ eye: camera.eye(), basis: camera.basis() }))(shown([]));
  /** A big triangle across the view, at a fraction of the way from the eye to the origin. */
  const across = (part) => [[-9, -9], [9, -9], [0, 9]].flatMap(([x, y]) => add(scale(eye, 1 - part), add(scale(basis.right, x), scale(basis.up, y))));
  const cloth = (part) => ({ positions: across(part), triangles: [0, 1, 2] });
  const behind = shown([SPHERE], cloth(0.5));
  const { yaw } = behind.camera;
  at(behind, "pointerdown");
  at(behind, "pointermove", 50);
  assert.notEqual(behind.camera.yaw, yaw);
  assert.deepEqual(behind.sent, []);
  assert.ok(isCarried(shown([SPHERE], cloth(1.5))));
  assert.ok(!isCarried(shown([SPHERE], cloth((length(eye) - SPHERE.radius + 0.01) / length(eye)))), "cloth on the solid, which cuts into it a little");
  const torn = shown([SPHERE], cloth(0.5));
  torn.simulation.topology.kill(0);
  assert.ok(isCarried(torn), "a triangle that is gone");
  assert.ok(isCarried(shown([SPHERE, FLOOR])));
  assert.ok(!isCarried(shown([{ ...SPHERE, center: [0, -2, 0], radius: 1.8 }, { ...FLOOR, offset: 0.1 }])));
});

test("the nearest solid is carried", () => {
  const page = shown([{ ...SPHERE, index: 0, center: [0, 0, 0] }, { ...SPHERE, index: 3 }]);
  page.simulation.receiveColliders([{ ...SPHERE, center: scale(page.camera.eye(), -0.4) }, { ...SPHERE, index: 3, center: scale(page.camera.eye(), 0.4) }]);
  at(page, "pointerdown");
  assert.deepEqual(page.input.tool.carried, { object: "collider", index: 3 });
});

test("in 2-D, a circle and a turned rectangle are carried in their plane, from any distance", () => {
  const turned = { ...BOX, halfExtents: [0.5, 0.05, 0], rotation: [0, 0, Math.SQRT1_2, Math.SQRT1_2] };
  for (const solid of [{ ...SPHERE, radius: 50 }, SPHERE, turned]) {
    const page = shown([solid], { isPlanar: true });
    at(page, "pointerdown");
    at(page, "pointermove", 30, -60);
    page.input.tick(performance.now());
    const unit = page.camera.unitsPerPixel([0, 0, 0], VIEWPORT);
    nearly(page.sent[1].offset, [30 * unit, 60 * unit, 0], 1e-9);
  }
  const page = shown([turned], { isPlanar: true });
  const pixels = 0.2 / page.camera.unitsPerPixel([0, 0, 0], VIEWPORT);
  at(page, "pointerdown", pixels);
  assert.equal(page.input.tool.carried, undefined, "beside the turned rectangle");
  at(page, "pointerup", pixels);
  at(page, "pointerdown", 0, pixels);
  assert.deepEqual(page.input.tool.carried, { object: "collider", index: 0 });
});

/** A page whose particle in the middle belongs to the second anchor. */
function anchored(flags = PIN.anchored, anchors = [[1], [0, 2]]) {
  const page = shown([], { positions: [0, 0, 0, ...FAR, ...FAR], anchors });
  page.simulation.receivePins({ particles: [0], flags: [flags] });
  return page;
}

test("a drag on an anchored particle carries its anchor, without a jump", () => {
  const page = anchored();
  at(page, "pointerdown", 6);
  at(page, "pointermove", 6, 40);
  page.input.tick(performance.now());
  assert.deepEqual(page.sent.map(({ kind, object, index }) => [kind, object, index]), [["lift", "anchor", 1], ["carry", "anchor", 1]]);
  nearly(page.sent[1].offset, scale(page.camera.basis().up, -40 * page.camera.unitsPerPixel([0, 0, 0], VIEWPORT)), 1e-6);
  assert.deepEqual(page.input.tool.describe().line.particle, 0);
  at(page, "pointerup", 6, 40);
  assert.equal(kinds(page).pop(), "throw");
});

test("a pinned particle, and one without a known anchor, are grabbed", () => {
  for (const page of [anchored(PIN.anchored | PIN.pinned), anchored(PIN.anchored, []), anchored(PIN.frozen)]) {
    at(page, "pointerdown");
    at(page, "pointermove", 40);
    assert.deepEqual(kinds(page), ["grab"]);
  }
});

test("a click selects an anchored particle, and P pins it while it is carried", () => {
  const page = anchored();
  at(page, "pointerdown");
  at(page, "pointerup");
  assert.deepEqual([page.sent, page.selection.items], [[], [{ kind: "particle", index: 0 }]]);
  at(page, "pointerdown");
  assert.ok(page.input.pinByKey());
  assert.deepEqual(kinds(page), ["pin"]);
  const solid = shown([SPHERE]);
  at(solid, "pointerdown");
  assert.ok(!solid.input.pinByKey());
});

test("a recording, another mode and the keys of the view carry nothing", () => {
  for (const [mode, canChange, change] of [["grab", false, {}], ["pin", true, {}], ["grab", true, { altKey: true }], ["grab", true, { shiftKey: true }]]) {
    const page = shown([SPHERE], { canChange });
    page.input.mode = mode;
    at(page, "pointerdown", 0, 0, change);
    at(page, "pointermove", 50);
    at(page, "pointerup", 50);
    assert.deepEqual(page.sent, []);
  }
});

test("the cursor shows a solid that can be carried, unless its mesh is large", () => {
  const cursor = (page) => {
    at(page, "pointermove");
    page.input.tick(0);
    return page.canvas.dataset.cursor;
  };
  assert.equal(cursor(shown([SPHERE])), "over");
  assert.equal(cursor(shown([FLOOR])), "grab");
  const mesh = (copies) => shown([MESH], { meshes: new Map([[0, { ...SQUARE, triangles: Uint32Array.from({ length: 6 * copies }, (_, i) => SQUARE.triangles[i % 6]) }]]) });
  assert.equal(cursor(mesh(1)), "over");
  assert.equal(cursor(mesh(10_001)), "grab");
  assert.ok(isCarried(mesh(10_001)));
});

test("a solid in front of a particle is carried, and a particle in front of a solid is grabbed", () => {
  const eye = (page) => page.camera.eye();
  for (const [share, isSolid] of [[-1.2, true], [0.9, false]]) {
    // On the line of sight through the middle of the sphere: behind it, or just in front.
    const toEye = scale(eye(shown([])), 0.4 * share / length(eye(shown([]))));
    const page = shown([SPHERE], { positions: isSolid ? toEye : scale(toEye, 1.2) });
    at(page, "pointerdown");
    assert.equal(page.input.tool.carried !== undefined, isSolid, `at ${share} radii`);
    assert.equal(page.input.tool.grabbed !== undefined, !isSolid);
  }
});
