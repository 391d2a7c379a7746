// Effects: which renderers draw them, and the view of the light.

import assert from "node:assert/strict";
import { test } from "node:test";
import { isSoftware } from "../js/gl/context.js";
import { clipBox, lightView } from "../js/gl/shadow-map.js";
import { normalize, transform } from "../js/geometry/math.js";

test("renderers without a graphics processor are known by their names", () => {
  for (const name of ["ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero)), SwiftShader driver)", "llvmpipe (LLVM 15.0.6, 256 bits)", "Mesa/X.org, softpipe", "Microsoft Basic Render Driver", "Apple Software Renderer"]) {
    assert.equal(isSoftware(name), true, name);
  }
  for (const name of ["ANGLE (NVIDIA, NVIDIA GeForce RTX 4070 Direct3D11)", "ANGLE (Intel, Mesa Intel(R) UHD Graphics 620, OpenGL 4.6)", "Apple M2", "Adreno (TM) 640"]) {
    assert.equal(isSoftware(name), false, name);
  }
});

test("the map of a light contains the box, and nearer to the light means less depth", () => {
  const box = { min: [-1, 0, 2], max: [3, 2, 2.5] };
  const light = normalize([-0.5, 0.8, 0.62]);
  const { map, clip, texel } = lightView(light, box);
  for (let corner = 0; corner < 8; corner++) {
    const [x, y, z, w] = transform(map, [0, 1, 2].map((axis) => (corner & (1 << axis) ? box.max : box.min)[axis]));
    assert.equal(w, 1);
    for (const value of [x, y, z]) assert.ok(value >= 0 && value <= 1, `${value}`);
  }
  const [low, high] = [[0, 0, 2], [0, 0, 2].map((value, axis) => value + 0.5 * light[axis])].map((point) => transform(map, point));
  assert.ok(high[2] < low[2]);
  assert.ok(Math.abs(high[0] - low[0]) < 1e-9 && Math.abs(high[1] - low[1]) < 1e-9, "light travels along the depth");
  // The map spans 2048 texels.
  const [left, right] = [[0, 0, 0], [1, 0, 0]].map((point) => transform(clip, point));
  assert.ok(Math.hypot(right[0] - left[0], right[1] - left[1], right[2] - left[2]) * 1024 * texel - 1 < 1e-9);
});

test("only the part of a scene near the picture casts shadows", () => {
  const box = { min: [-1, -900, -1], max: [1, 1, 1] };
  assert.deepEqual(clipBox(box, [0, 0, 0], 2), { min: [-1, -2, -1], max: [1, 1, 1] });
  assert.equal(clipBox(box, [50, 0, 0], 2), null);
});
