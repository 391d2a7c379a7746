// Shared uniforms lie where std140 places them (OpenGL ES 3.0, section 2.12.6.4), and the radius of marks follows their distance.

import assert from "node:assert/strict";
import { test } from "node:test";
import { gapOf } from "../../js/gl/buffers.js";
import { markRadius } from "../../js/gl/picture-uniforms.js";
import { SharedUniforms, std140 } from "../../js/gl/uniforms.js";

const offsetsOf = (members) => Object.fromEntries([...std140(members).places].map(([name, { offset }]) => [name, offset]));

test("vectors of three take the room of four, and a number fills the gap", () => {
  assert.deepEqual(offsetsOf({ a: "vec3", b: "float", c: "vec3", d: "vec2", e: "float" }), { a: 0, b: 12, c: 16, d: 32, e: 40 });
});

test("elements of an array are 16 bytes apart, and nothing fills the gap behind the last one", () => {
  const { places, size } = std140({ a: "float", b: "vec3[3]", c: "float", d: "mat4" });
  assert.deepEqual([...places.values()].map(({ offset }) => offset), [0, 16, 64, 80]);
  assert.equal(size, 144);
});

test("a block ends at a multiple of 16 bytes", () => {
  assert.equal(std140({ a: "vec4", b: "float" }).size, 32);
});

test("values are written at their places, and those of another pass can be copied", () => {
  const [picture, pass] = [new SharedUniforms(null), new SharedUniforms(null)];
  picture.write({ u_eye: [1, 2, 3], u_near: 4, u_viewport: Float32Array.of(5, 6), u_marks: [[1, 0, 0], [0, 1, 0], [0, 0, 1], [7, 8, 9]] });
  // A matrix of 64 bytes comes first.
  assert.deepEqual([...picture.numbers.subarray(16, 20)], [1, 2, 3, 4]);
  assert.deepEqual([...picture.members.u_viewport], [5, 6]);
  assert.deepEqual([...picture.members.u_marks], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 0]);
  pass.copyFrom(picture);
  pass.write({ u_near: 0 });
  assert.deepEqual([pass.members.u_eye[2], pass.members.u_near[0], picture.members.u_near[0]], [3, 0, 4]);
});

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
