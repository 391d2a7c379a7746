// The marks of particles that something holds: their size follows their distance.

import assert from "node:assert/strict";
import { test } from "node:test";
import { gapOf } from "../../js/gl/buffers.js";
import { markRadius } from "../../js/gl/picture-uniforms.js";

/** A sheet of `columns` particles per row, 2 cm apart. */
const sheet = (columns, rows) => Float32Array.from({ length: 3 * columns * rows }, (_, k) => [0.02 * (Math.floor(k / 3) % columns), -0.02 * Math.floor(k / 3 / columns), 0][k % 3]);

test("the gap is that of neighbours in a row or a column, and wide between corners", () => {
  const positions = sheet(50, 40);
  const near = (value, expected) => assert.ok(Math.abs(value - expected) < 1e-6, `${value} is not ${expected}`);
  near(gapOf(positions, Array.from({ length: 50 }, (_, c) => 49 - c)), 0.02);
  near(gapOf(positions, Array.from({ length: 40 }, (_, r) => 50 * r)), 0.02);
  near(gapOf(positions, [0, 49]), 0.98);
  assert.equal(gapOf(positions, [7]), Infinity);
  assert.equal(gapOf(positions, []), Infinity);
});

test("marks that are close together do not touch, until they are as small as can be seen", () => {
  assert.equal(markRadius(168, 40), 5.5);
  assert.equal(markRadius(10_000, Infinity), 4);
  for (const gap of [5, 8, 12]) assert.ok(2 * markRadius(651, gap) < gap, `${gap} px`);
  assert.equal(markRadius(10_000, 0.5), 1.6);
});
