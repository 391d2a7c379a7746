// Rays against solids and triangles. Each function returns the distance to the first hit, in lengths of
// the direction of the ray, or Infinity without one. A ray that starts in a solid does not hit it: from
// there, the solid is not in front of anything.

import { addScaled, clamp, dot, rotate, subtract } from "./math.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** @typedef {import("./camera.js").Ray} Ray */
/** @typedef {import("./pick.js").Points} Points */

/** @param {Ray} ray @param {Vec3} center @param {number} radius */
export function hitSphere({ origin, direction }, center, radius) {
  const from = subtract(origin, center);
  const a = dot(direction, direction);
  const b = dot(from, direction);
  const c = dot(from, from) - radius * radius;
  const root = b * b - a * c;
  return c > 0 && b < 0 && root >= 0 ? (-b - Math.sqrt(root)) / a : Infinity;
}

/** @param {Ray} ray @param {Vec3} center @param {Vec3} half extents @param {number[]} rotation quaternion x, y, z, w */
export function hitBox(ray, center, half, rotation) {
  const { origin, direction } = intoBody(ray, center, rotation);
  let enter = -Infinity;
  let leave = Infinity;
  for (let axis = 0; axis < 3; axis++) {
    if (direction[axis] === 0) {
      if (Math.abs(origin[axis]) > half[axis]) return Infinity;
      continue;
    }
    const middle = -origin[axis] / direction[axis];
    const reach = half[axis] / Math.abs(direction[axis]);
    enter = Math.max(enter, middle - reach);
    leave = Math.min(leave, middle + reach);
  }
  return enter >= 0 && enter <= leave ? enter : Infinity;
}

/** @param {Ray} ray @param {Vec3} a @param {Vec3} b @param {number} radius */
export function hitCapsule(ray, a, b, radius) {
  const { origin, direction } = ray;
  const axis = subtract(b, a);
  const from = subtract(origin, a);
  const long = dot(axis, axis);
  const along = dot(from, axis);
  const nearest = addScaled(from, axis, long > 0 ? -clamp(along / long, 0, 1) : 0);
  if (dot(nearest, nearest) <= radius * radius) return Infinity;
  const ends = Math.min(hitSphere(ray, a, radius), hitSphere(ray, b, radius));
  // The side, where the distance from the axis is the radius. All terms are times the squared length of the axis.
  const slope = dot(direction, axis);
  const qa = long * dot(direction, direction) - slope * slope;
  const qb = long * dot(from, direction) - slope * along;
  const qc = long * (dot(from, from) - radius * radius) - along * along;
  const root = qb * qb - qa * qc;
  if (!(qa > 0 && root >= 0)) return ends;
  const side = (-qb - Math.sqrt(root)) / qa;
  const at = along + side * slope;
  return side >= 0 && at >= 0 && at <= long ? Math.min(side, ends) : ends;
}

/** The first of a body's triangles, seen from either side. @param {Ray} ray @param {Vec3} center @param {number[]} rotation @param {Float32Array} vertices relative to the center, before the rotation @param {Uint32Array} triangles */
export function hitMesh(ray, center, rotation, vertices, triangles) {
  return hitTriangles(intoBody(ray, center, rotation), { positions: vertices, lo: [0, 0, 0], scale: [1, 1, 1] }, triangles);
}

/** The first triangle, seen from either side (Möller and Trumbore). It creates nothing per triangle.
 * @param {Ray} ray @param {Points} points @param {ArrayLike<number>} triangles @param {(triangle: number) => boolean} isShown */
export function hitTriangles({ origin, direction }, { positions: p, lo, scale }, triangles, isShown = () => true) {
  const [dx, dy, dz] = direction;
  const [ox, oy, oz] = subtract(origin, lo);
  const [sx, sy, sz] = scale;
  let first = Infinity;
  for (let corner = 0; corner + 2 < triangles.length; corner += 3) {
    const a = 3 * triangles[corner], b = 3 * triangles[corner + 1], c = 3 * triangles[corner + 2];
    const ux = sx * (p[b] - p[a]), uy = sy * (p[b + 1] - p[a + 1]), uz = sz * (p[b + 2] - p[a + 2]);
    const vx = sx * (p[c] - p[a]), vy = sy * (p[c + 1] - p[a + 1]), vz = sz * (p[c + 2] - p[a + 2]);
    const nx = dy * vz - dz * vy, ny = dz * vx - dx * vz, nz = dx * vy - dy * vx;
    const volume = ux * nx + uy * ny + uz * nz;
    const fx = ox - sx * p[a], fy = oy - sy * p[a + 1], fz = oz - sz * p[a + 2];
    const u = (fx * nx + fy * ny + fz * nz) / volume;
    // A triangle without area, or with a corner that is not finite, fails each of these.
    if (!(u >= 0 && u <= 1)) continue;
    const qx = fy * uz - fz * uy, qy = fz * ux - fx * uz, qz = fx * uy - fy * ux;
    const v = (dx * qx + dy * qy + dz * qz) / volume;
    if (!(v >= 0 && u + v <= 1)) continue;
    const at = (vx * qx + vy * qy + vz * qz) / volume;
    if (at >= 0 && at < first && isShown(corner / 3)) first = at;
  }
  return first;
}

/** The plane normal · x = offset, from either side. @param {Ray} ray @param {Vec3} normal @param {number} offset */
export function hitPlane({ origin, direction }, normal, offset) {
  const at = (offset - dot(origin, normal)) / dot(direction, normal);
  return at >= 0 ? at : Infinity;
}

/** The ray in the axes of a body, at the same distances. @param {Ray} ray @param {Vec3} center @param {number[]} rotation @returns {Ray} */
function intoBody({ origin, direction }, center, rotation) {
  const back = [-rotation[0], -rotation[1], -rotation[2], rotation[3]];
  return { origin: rotate(back, subtract(origin, center)), direction: rotate(back, direction) };
}
