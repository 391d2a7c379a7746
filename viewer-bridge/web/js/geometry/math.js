// 3-vectors and column-major 4 x 4 matrices, as plain arrays of doubles: the page transforms only a
// handful of points per frame, and WebGL accepts plain arrays for uniforms.

/** @typedef {[number, number, number]} Vec3 */
/** @typedef {number[]} Mat4  16 numbers, column-major */
/** @typedef {{ min: Vec3, max: Vec3 }} Box */

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** @param {Vec3} a @param {number} factor @returns {Vec3} */
export const scale = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];

/** a + b · factor. @param {Vec3} a @param {Vec3} b @param {number} factor @returns {Vec3} */
export const addScaled = (a, b, factor) => [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor];

/** @param {Vec3} a @param {Vec3} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** @param {Vec3} a */
export const length = (a) => Math.hypot(a[0], a[1], a[2]);

/** A unit vector along `a`; the zero vector stays zero. @param {Vec3} a @returns {Vec3} */
export function normalize(a) {
  const norm = length(a);
  return norm > 0 ? scale(a, 1 / norm) : [0, 0, 0];
}

/** @param {number} value @param {number} low @param {number} high */
export const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/** Two unit vectors that form a right-handed basis with the unit vector `n`. @param {Vec3} n @returns {[Vec3, Vec3]} */
export function tangents(n) {
  const helper = /** @type {Vec3} */ (Math.abs(n[0]) < 0.6 ? [1, 0, 0] : [0, 0, 1]);
  const u = normalize(subtract(helper, scale(n, dot(n, helper))));
  return [u, cross(n, u)];
}

/** `v` rotated by the quaternion x, y, z, w. @param {number[]} q @param {Vec3} v @returns {Vec3} */
export function rotate(q, v) {
  const axis = /** @type {Vec3} */ ([q[0], q[1], q[2]]);
  const twice = scale(cross(axis, v), 2);
  return add(addScaled(v, twice, q[3]), cross(axis, twice));
}

/** @returns {Mat4} */
export const identity = () => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** a · b, written into `product`, which is neither of them. @param {Mat4} a @param {Mat4} b @param {Mat4} product @returns {Mat4} */
export function multiply(a, b, product = new Array(16).fill(0)) {
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[k * 4 + row] * b[column * 4 + k];
      product[column * 4 + row] = sum;
    }
  }
  return product;
}

/** Scales by `factors`, then translates by `offset`. @param {Vec3} offset @param {Vec3} factors @returns {Mat4} */
export const scaleThenMove = (offset, factors) => [
  factors[0], 0, 0, 0, 0, factors[1], 0, 0, 0, 0, factors[2], 0, offset[0], offset[1], offset[2], 1,
];

/** The matrix with these columns. @param {Vec3} x @param {Vec3} y @param {Vec3} z @param {Vec3} origin @returns {Mat4} */
export const frameOf = (x, y, z, origin) => [...x, 0, ...y, 0, ...z, 0, ...origin, 1];

/** m · (p, 1), in homogeneous coordinates. @param {Mat4} m @param {Vec3} p @returns {[number, number, number, number]} */
export const transform = (m, p) => [
  m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12],
  m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13],
  m[2] * p[0] + m[6] * p[1] + m[10] * p[2] + m[14],
  m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15],
];

/**
 * The projection of a shadow: along `light` onto the plane normal · x = offset.
 *
 * x' = x - light · (normal · x - offset) / (normal · light), times normal · light to stay linear.
 * A light parallel to the plane casts no shadow: the matrix is then singular.
 * @param {Vec3} normal @param {number} offset @param {Vec3} light direction towards the light
 * @returns {Mat4}
 */
export function shadowOnto(normal, offset, light) {
  const d = dot(normal, light);
  const m = new Array(16).fill(0);
  for (let column = 0; column < 3; column++) {
    for (let row = 0; row < 3; row++) {
      m[column * 4 + row] = (row === column ? d : 0) - light[row] * normal[column];
    }
  }
  for (let row = 0; row < 3; row++) m[12 + row] = light[row] * offset;
  m[15] = d;
  return m;
}

/** The bounding box of points given as x, y, z triples; a unit box if there are none. @param {ArrayLike<number>} xyz @returns {Box} */
export function boxOf(xyz) {
  if (xyz.length < 3) return { min: [-0.5, -0.5, -0.5], max: [0.5, 0.5, 0.5] };
  const min = /** @type {Vec3} */ ([Infinity, Infinity, Infinity]);
  const max = /** @type {Vec3} */ ([-Infinity, -Infinity, -Infinity]);
  for (let i = 0; i < xyz.length; i++) {
    const axis = i % 3;
    if (xyz[i] < min[axis]) min[axis] = xyz[i];
    if (xyz[i] > max[axis]) max[axis] = xyz[i];
  }
  return { min, max };
}

/** True for equal lists of numbers. @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
export function sameNumbers(a, b) {
  if (a.length !== b.length) return false;
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

/** The smallest 1, 2 or 5 times a power of ten that is at least `value`. @param {number} value */
export function niceCeiling(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= value * (1 - 1e-12)) ?? 10;
  return step * power;
}

/** Factors of the ends of a colour scale: each is at most 4/3 of the one before. */
const ENDS = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];

/** The smallest short number that is at least `value`, so that `value` fills three quarters of it; 0 for 0. @param {number} value */
export function niceEnd(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  const end = ENDS.find((factor) => factor * power >= value * (1 - 1e-6)) ?? 10;
  return Number((end * power).toPrecision(2));
}

/** The greatest 1, 2 or 5 times a power of ten that is at most `value`. @param {number} value */
export function niceFloor(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [5, 2, 1].find((factor) => factor * power <= value * (1 + 1e-12)) ?? 1;
  return step * power;
}
