// Vectors and matrices against closed forms.

import assert from "node:assert/strict";
import { test } from "node:test";
import { boxOf, cross, dot, frameOf, identity, multiply, normalize, rotate, scaleThenMove, shadowOnto, tangents, transform } from "../js/geometry/math.js";

const near = (a, b, within = 1e-12) => a.forEach((value, i) => assert.ok(Math.abs(value - b[i]) <= within, `${a} is not ${b}`));

test("the product of two matrices applies one after the other", () => {
  const a = scaleThenMove([1, 2, 3], [2, 2, 2]);
  const b = frameOf([0, 1, 0], [-1, 0, 0], [0, 0, 1], [5, 0, 0]);
  const p = [0.3, -0.7, 1.1];
  const once = transform(multiply(a, b), p);
  near(once, transform(a, transform(b, p).slice(0, 3)));
  near(multiply(a, identity()), a);
});

test("a quarter turn about z rotates x to y", () => {
  const half = Math.SQRT1_2;
  near(rotate([0, 0, half, half], [1, 0, 0]), [0, 1, 0]);
  near(rotate([0, 0, 0, 1], [1, 2, 3]), [1, 2, 3]);
});

test("tangents and their normal form a right-handed basis for any normal", () => {
  for (const n of [[0, 1, 0], [1, 0, 0], [0, 0, -1], normalize([1, 2, -3])]) {
    const [u, v] = tangents(n);
    near([dot(u, n), dot(v, n), dot(u, v)], [0, 0, 0]);
    near(cross(u, v), n);
  }
});

test("a shadow lies on its plane and on the line towards the light", () => {
  const normal = normalize([0.1, 1, 0.2]);
  const light = normalize([-0.4, 0.8, 0.3]);
  const p = [0.7, 2, -0.4];
  const [x, y, z, w] = transform(shadowOnto(normal, 0.25, light), p);
  const shadow = [x / w, y / w, z / w];
  assert.ok(Math.abs(dot(normal, shadow) - 0.25) < 1e-12);
  near(cross(shadow.map((value, i) => value - p[i]), light), [0, 0, 0]);
});

test("a box contains its points, and an empty list has a unit box", () => {
  assert.deepEqual(boxOf([1, 2, 3, -1, 5, 0]), { min: [-1, 2, 0], max: [1, 5, 3] });
  assert.deepEqual(boxOf([]), { min: [-0.5, -0.5, -0.5], max: [0.5, 0.5, 0.5] });
});
