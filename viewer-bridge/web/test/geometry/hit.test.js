// Rays against solids, compared with closed forms.

import assert from "node:assert/strict";
import { test } from "node:test";
import { hitBox, hitCapsule, hitMesh, hitPlane, hitSphere, hitTriangles } from "../../js/geometry/hit.js";
import { normalize, rotate } from "../../js/geometry/math.js";

const NO_ROTATION = [0, 0, 0, 1];
/** A rotation by an angle about z. */
const about = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
const ray = (origin, direction) => ({ origin, direction });
const near = (value, expected) => assert.ok(Math.abs(value - expected) < 1e-9, `${value} is not ${expected}`);

test("a ray enters a sphere where its distance from the center is the radius", () => {
  for (const aside of [0, 0.3, 0.99]) near(hitSphere(ray([aside, 0, 5], [0, 0, -1]), [0, 0, 1], 1), 4 - Math.sqrt(1 - aside * aside));
  near(hitSphere(ray([0, 0, 5], [0, 0, -2]), [0, 0, 0], 1), 2);
  assert.equal(hitSphere(ray([1.01, 0, 5], [0, 0, -1]), [0, 0, 0], 1), Infinity);
  assert.equal(hitSphere(ray([0, 0, 5], [0, 0, 1]), [0, 0, 0], 1), Infinity, "behind the ray");
});

test("a ray enters a box at its nearest face", () => {
  const half = [1, 2, 3];
  near(hitBox(ray([0.5, -1.5, 9], [0, 0, -1]), [0, 0, 0], half, NO_ROTATION), 6);
  near(hitBox(ray([9, 0, 0], [-1, 0, 0]), [4, 0, 0], half, NO_ROTATION), 4);
  assert.equal(hitBox(ray([1.5, 0, 9], [0, 0, -1]), [0, 0, 0], half, NO_ROTATION), Infinity);
  assert.equal(hitBox(ray([0, 0, 9], [0, 0, 1]), [0, 0, 0], half, NO_ROTATION), Infinity);
  // From a corner along the diagonal, the distance to the face x = 1 divides by the cosine.
  near(hitBox(ray([3, 3, 3], normalize([-1, -1, -1])), [0, 0, 0], [1, 1, 1], NO_ROTATION), 2 * Math.sqrt(3));
});

test("a ray enters a turned box at its turned face, and a flat one at its plane", () => {
  // A square turned by 45 degrees has its corner on the axis.
  near(hitBox(ray([5, 0, 0], [-1, 0, 0]), [0, 0, 0], [1, 1, 1], about(Math.PI / 4)), 5 - Math.SQRT2);
  near(hitBox(ray([5, 0.5, 0], [-1, 0, 0]), [0, 0, 0], [1, 1, 1], about(Math.PI / 4)), 5 - (Math.SQRT2 - 0.5));
  near(hitBox(ray([0.5, 1.2, 3], [0, 0, -1]), [0, 0, 0], [2, 1, 0], about(Math.PI / 2)), 3);
  assert.equal(hitBox(ray([1.2, 0.5, 3], [0, 0, -1]), [0, 0, 0], [2, 1, 0], about(Math.PI / 2)), Infinity);
});

test("a ray enters a capsule at its side or at its round ends", () => {
  const [a, b] = [[0, -1, 0], [0, 1, 0]];
  for (const y of [-1, 0, 0.7]) near(hitCapsule(ray([0.3, y, 4], [0, 0, -1]), a, b, 0.5), 4 - 0.4);
  near(hitCapsule(ray([0, 1.3, 4], [0, 0, -1]), a, b, 0.5), 4 - 0.4);
  near(hitCapsule(ray([0, 5, 0], [0, -1, 0]), a, b, 0.5), 3.5);
  assert.equal(hitCapsule(ray([0, 1.6, 4], [0, 0, -1]), a, b, 0.5), Infinity);
  assert.equal(hitCapsule(ray([0.6, 5, 0], [0, -1, 0]), a, b, 0.5), Infinity, "along the side");
  near(hitCapsule(ray([0, 0, 4], [0, 0, -1]), a, a, 2), 4 - Math.sqrt(3));
});

test("a ray that starts in a solid does not hit it", () => {
  for (const direction of [[0, 0, -1], [0, 1, 0], normalize([1, 2, 3])]) {
    const inside = ray([0.1, 0.2, 0], direction);
    assert.equal(hitSphere(inside, [0, 0, 0], 1), Infinity);
    assert.equal(hitBox(inside, [0, 0, 0], [1, 1, 1], about(0.3)), Infinity);
    assert.equal(hitCapsule(inside, [0, -3, 0], [0, 3, 0], 0.5), Infinity);
  }
});

test("a triangle is hit within its edges, from both sides", () => {
  const points = { positions: Float32Array.from([0, 0, 0, 2, 0, 0, 0, 2, 0]), lo: [0, 0, 0], scale: [1, 1, 1] };
  const triangle = Uint32Array.from([0, 1, 2]);
  near(hitTriangles(ray([0.9, 0.9, 3], [0, 0, -1]), points, triangle), 3);
  near(hitTriangles(ray([0.9, 0.9, -4], [0, 0, 1]), points, triangle), 4);
  assert.equal(hitTriangles(ray([1.1, 1.1, 3], [0, 0, -1]), points, triangle), Infinity);
  assert.equal(hitTriangles(ray([0.9, 0.9, 3], [0, 0, 1]), points, triangle), Infinity);
  assert.equal(hitTriangles(ray([-1, 0.5, 0], [1, 0, 0]), points, triangle), Infinity, "in its plane");
  assert.equal(hitTriangles(ray([0.9, 0.9, 3], [0, 0, -1]), points, triangle, () => false), Infinity);
  assert.equal(hitTriangles(ray([0.9, 0.9, 3], [0, 0, -1]), { ...points, positions: points.positions.map((value, i) => (i === 4 ? NaN : value)) }, triangle), Infinity);
});

test("the nearest triangle counts, also of quantised positions", () => {
  const positions = Uint16Array.from([0, 0, 0, 65535, 0, 0, 0, 65535, 0, 0, 0, 65535, 65535, 0, 65535, 0, 65535, 65535]);
  const points = { positions, lo: [-1, -1, -1], scale: [2 / 65535, 2 / 65535, 1 / 65535] };
  const triangles = Uint32Array.from([0, 1, 2, 3, 4, 5]);
  near(hitTriangles(ray([-0.5, -0.5, 3], [0, 0, -1]), points, triangles), 3);
  near(hitTriangles(ray([-0.5, -0.5, 3], [0, 0, -1]), points, triangles, (triangle) => triangle === 0), 4);
  near(hitTriangles(ray([-0.5, -0.5, -3], [0, 0, 1]), points, triangles), 2);
});

test("a mesh is hit where its pose puts its triangles", () => {
  // The tetrahedron between the origin and the axes, turned and moved like its vertices.
  const vertices = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
  const triangles = Uint32Array.from([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
  const [center, rotation] = [[4, -2, 1], about(0.7)];
  const place = (point) => rotate(rotation, point).map((value, axis) => value + center[axis]);
  // The face x + y + z = 1 lies at 1 / sqrt(3) from the origin.
  const toward = rotate(rotation, normalize([-1, -1, -1]));
  near(hitMesh(ray(place([2, 2, 2]), toward), center, rotation, vertices, triangles), 2 * Math.sqrt(3) - 1 / Math.sqrt(3));
  assert.equal(hitMesh(ray(place([2, 2, 1]), toward), center, rotation, vertices, triangles) < Infinity, false);
});

test("a plane is met from both sides, at the distance along the ray", () => {
  near(hitPlane(ray([0, 3, 0], normalize([0, -1, 1])), [0, 1, 0], 1), 2 * Math.SQRT2);
  near(hitPlane(ray([0, -3, 0], [0, 1, 0]), [0, 1, 0], 1), 4);
  assert.equal(hitPlane(ray([0, 3, 0], [0, 1, 0]), [0, 1, 0], 1), Infinity);
  assert.equal(hitPlane(ray([0, 3, 0], [1, 0, 0]), [0, 1, 0], 1), Infinity);
});
