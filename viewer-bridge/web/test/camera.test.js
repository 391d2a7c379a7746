// Camera matrices, rays and plane intersections agree with each other and with pinhole geometry.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera, sceneAxes } from "../js/geometry/camera.js";
import { addScaled, cross, dot, length, subtract } from "../js/geometry/math.js";

const VIEWPORT = { width: 800, height: 500 };

function cameras() {
  const turned = Object.assign(new Camera(), { target: [0.2, 1, -0.3], distance: 4, yaw: 0.7, pitch: -0.3 });
  const screen = Object.assign(new Camera(), { axes: sceneAxes("-y", 2), isFlat: true, target: [250, 200, 0], distance: 600, sceneRadius: 300 });
  const tall = Object.assign(new Camera(), { axes: sceneAxes("z", 3), yaw: -1.2, pitch: 0.5 });
  return { turned, screen, tall };
}

test("the ray through a projected point passes through the point", () => {
  for (const [name, camera] of Object.entries(cameras())) {
    const point = addScaled(addScaled(camera.target, camera.basis().right, camera.distance * 0.1), camera.basis().up, camera.distance * 0.05);
    const pixel = camera.project(point, VIEWPORT);
    const { origin, direction } = camera.ray(pixel.x, pixel.y, VIEWPORT);
    const off = length(cross(subtract(point, origin), direction));
    assert.ok(off < 1e-9 * camera.distance, `${name}: ${off}`);
  }
});

test("the target is at the centre of the picture", () => {
  for (const camera of Object.values(cameras())) {
    const { x, y } = camera.project(camera.target, VIEWPORT);
    assert.ok(Math.abs(x - 400) < 1e-9 && Math.abs(y - 250) < 1e-9);
  }
});

test("a grab stays on the camera-facing plane through the particle, under the pointer", () => {
  for (const camera of Object.values(cameras())) {
    const particle = addScaled(camera.target, camera.basis().back, camera.isFlat ? 0 : 0.4);
    const hit = camera.intersectFacingPlane(610, 120, VIEWPORT, particle);
    assert.ok(Math.abs(dot(subtract(hit, particle), camera.basis().back)) < 1e-9 * camera.distance);
    const pixel = camera.project(hit, VIEWPORT);
    assert.ok(Math.abs(pixel.x - 610) < 1e-6 && Math.abs(pixel.y - 120) < 1e-6);
  }
});

test("in 2-D a grab keeps z at exactly 0", () => {
  const { screen } = cameras();
  assert.equal(screen.intersectFacingPlane(13, 477, VIEWPORT, [0, 0, 0])[2], 0);
});

test("unitsPerPixel is the distance between neighbouring pixels", () => {
  for (const camera of Object.values(cameras())) {
    const a = camera.intersectFacingPlane(300, 200, VIEWPORT, camera.target);
    const b = camera.intersectFacingPlane(301, 200, VIEWPORT, camera.target);
    assert.ok(Math.abs(length(subtract(a, b)) / camera.unitsPerPixel(camera.target, VIEWPORT) - 1) < 1e-9);
  }
});

test("an object at twice the distance appears half as big, and in 2-D equally big", () => {
  const { turned, screen } = cameras();
  const size = (camera, back) => {
    const at = addScaled(camera.target, camera.basis().back, -back);
    const from = camera.project(at, VIEWPORT);
    const to = camera.project(addScaled(at, camera.basis().right, 1), VIEWPORT);
    return to.x - from.x;
  };
  assert.ok(Math.abs(size(turned, 0) / size(turned, turned.distance) - 2) < 1e-9);
  assert.ok(Math.abs(size(screen, 0) / size(screen, 50) - 1) < 1e-9);
});

test("zooming keeps the point under the pointer in place", () => {
  for (const camera of Object.values(cameras())) {
    const at = camera.intersectFacingPlane(200, 400, VIEWPORT, camera.target);
    camera.zoom(1.7, 200, 400, VIEWPORT);
    const pixel = camera.project(at, VIEWPORT);
    assert.ok(Math.abs(pixel.x - 200) < 1e-6 && Math.abs(pixel.y - 400) < 1e-6);
  }
});

test("panning moves the picture along with the pointer", () => {
  for (const camera of Object.values(cameras())) {
    const at = camera.target;
    camera.pan(30, -20, VIEWPORT);
    const pixel = camera.project(at, VIEWPORT);
    assert.ok(Math.abs(pixel.x - 430) < 1e-6 && Math.abs(pixel.y - 230) < 1e-6);
  }
});

test("a framed box fits a wide or tall picture and fills most of it", () => {
  for (const viewport of [VIEWPORT, { width: 390, height: 800 }]) {
    for (const camera of Object.values(cameras())) {
      const box = { min: [-1, 0, -0.5], max: [3, 2, 0.5] };
      camera.frame(box, viewport.width / viewport.height);
      let widest = 0;
      for (let corner = 0; corner < 8; corner++) {
        const point = [0, 1, 2].map((axis) => (corner & (1 << axis) ? box.max : box.min)[axis]);
        const { x, y } = camera.project(point, viewport);
        assert.ok(x >= 0 && x <= viewport.width && y >= 0 && y <= viewport.height, `${x} ${y}`);
        widest = Math.max(widest, Math.abs(x / viewport.width - 0.5), Math.abs(y / viewport.height - 0.5));
      }
      // The corner that needs the most room touches the margin.
      assert.ok(Math.abs(widest - 0.43) < 1e-6, `${widest}`);
    }
  }
});

test("in 2-D y points up, or down if the scene says so", () => {
  const camera = Object.assign(new Camera(), { isFlat: true });
  for (const [up, sign] of [["y", -1], ["-y", 1]]) {
    camera.axes = sceneAxes(up, 2);
    const from = camera.project([0, 0, 0], VIEWPORT);
    const to = camera.project([0.1, 0.1, 0], VIEWPORT);
    assert.equal(Math.sign(to.y - from.y), sign);
    assert.ok(to.x > from.x);
  }
});

test("a point behind the eye has no pixel", () => {
  const { turned } = cameras();
  assert.equal(turned.project(addScaled(turned.eye(), turned.basis().back, 1), VIEWPORT), null);
});
