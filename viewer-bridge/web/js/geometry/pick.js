// Picking: the particle under the pointer, and the sticks that a cutting stroke crosses. Linear scans
// over all particles take well under a millisecond at 20,000, and run only when the pointer moves.

import { multiply, scaleThenMove } from "./math.js";

/** @typedef {import("./math.js").Mat4} Mat4 */
/** @typedef {import("./camera.js").Viewport} Viewport */
/** @typedef {{ positions: ArrayLike<number>, lo: import("./math.js").Vec3, scale: import("./math.js").Vec3 }} Points */
/** @typedef {{ x: number, y: number }} Pixel */

/** Depth of the foremost layer, in search radii: a particle that much nearer to the eye is in front. */
const LAYER_RADII = 2;

/** The matrix from the values of a frame to clip space. @param {Mat4} viewProjection @param {Points} points */
export const frameToClip = (viewProjection, points) => multiply(viewProjection, scaleThenMove(points.lo, points.scale));

/**
 * The particle at a pixel: of the particles within `radius`, the one in the foremost layer that is
 * nearest to the pixel.
 * @param {Points} points @param {Mat4} viewProjection @param {Viewport} viewport
 * @param {Pixel} at @param {number} radius CSS pixels
 * @returns {number | null}
 */
export function pickParticle(points, viewProjection, viewport, at, radius) {
  const candidates = particlesWithin(points, viewProjection, viewport, at, radius);
  if (candidates.length === 0) return null;
  const front = candidates.reduce((least, one) => Math.min(least, one.w), Infinity);
  // The size of a pixel in the world is proportional to its depth w, so depths compare with the radius.
  const layer = front * (1 + (LAYER_RADII * radius) / viewport.height);
  const inFront = candidates.filter((one) => one.w <= layer);
  return inFront.reduce((best, one) => (one.squared < best.squared ? one : best)).particle;
}

/** @param {Points} points @param {Mat4} viewProjection @param {Viewport} viewport @param {Pixel} at @param {number} radius */
export function particlesWithin(points, viewProjection, viewport, at, radius) {
  const m = frameToClip(viewProjection, points);
  const p = points.positions;
  const [m0, m4, m8, m12] = [m[0], m[4], m[8], m[12]];
  const [m1, m5, m9, m13] = [m[1], m[5], m[9], m[13]];
  const [m3, m7, m11, m15] = [m[3], m[7], m[11], m[15]];
  const halfWidth = viewport.width / 2;
  const halfHeight = viewport.height / 2;
  const limit = radius * radius;
  /** @type {{ particle: number, squared: number, w: number }[]} */
  const particles = [];
  for (let i = 0; i + 2 < p.length; i += 3) {
    const x = p[i], y = p[i + 1], z = p[i + 2];
    const w = m3 * x + m7 * y + m11 * z + m15;
    if (w <= 0) continue;
    const dx = ((m0 * x + m4 * y + m8 * z + m12) / w + 1) * halfWidth - at.x;
    const dy = (1 - (m1 * x + m5 * y + m9 * z + m13) / w) * halfHeight - at.y;
    const squared = dx * dx + dy * dy;
    if (squared <= limit) particles.push({ particle: i / 3, squared, w });
  }
  return particles;
}

/**
 * The constraint at a pixel: of those within `radius`, the nearest one in the foremost layer.
 * @param {Points} points @param {Mat4} viewProjection @param {Viewport} viewport @param {Pixel} at @param {number} radius
 * @param {ArrayLike<number>} ends @param {(constraint: number) => boolean} isShown @returns {number | null}
 */
export function pickConstraint(points, viewProjection, viewport, at, radius, ends, isShown) {
  const pixels = projectAll(points, viewProjection, viewport);
  const m = frameToClip(viewProjection, points);
  const p = points.positions;
  const depth = (/** @type {number} */ i) => m[3] * p[3 * i] + m[7] * p[3 * i + 1] + m[11] * p[3 * i + 2] + m[15];
  /** @type {{ constraint: number, squared: number, w: number }[]} */
  const near = [];
  for (let i = 0; 2 * i < ends.length; i++) {
    const a = ends[2 * i], b = ends[2 * i + 1];
    const [ax, ay, bx, by] = [pixels[2 * a], pixels[2 * a + 1], pixels[2 * b], pixels[2 * b + 1]];
    const long = (bx - ax) ** 2 + (by - ay) ** 2;
    const t = long > 0 ? Math.min(1, Math.max(0, ((at.x - ax) * (bx - ax) + (at.y - ay) * (by - ay)) / long)) : 0;
    const squared = (ax + t * (bx - ax) - at.x) ** 2 + (ay + t * (by - ay) - at.y) ** 2;
    if (squared <= radius * radius && isShown(i)) near.push({ constraint: i, squared, w: depth(a) + t * (depth(b) - depth(a)) });
  }
  if (near.length === 0) return null;
  const layer = near.reduce((least, one) => Math.min(least, one.w), Infinity) * (1 + (LAYER_RADII * radius) / viewport.height);
  return near.filter((one) => one.w <= layer).reduce((best, one) => (one.squared < best.squared ? one : best)).constraint;
}

/** Grain of the pixels of `projectAll`: with 24 bits, they are exact up to 16,384. */
const PIXEL_GRAIN = 2 ** -10;
const onGrid = (/** @type {number} */ pixel) => Math.round(pixel / PIXEL_GRAIN) * PIXEL_GRAIN;

/** The CSS pixel of every particle, as x, y pairs, in multiples of PIXEL_GRAIN; NaN behind the eye. @param {Points} points @param {Mat4} viewProjection @param {Viewport} viewport */
export function projectAll(points, viewProjection, viewport) {
  const m = frameToClip(viewProjection, points);
  const p = points.positions;
  const pixels = new Float32Array((p.length / 3) * 2);
  for (let i = 0, o = 0; i + 2 < p.length; i += 3, o += 2) {
    const x = p[i], y = p[i + 1], z = p[i + 2];
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    pixels[o] = w > 0 ? onGrid(((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) * 0.5 * viewport.width) : NaN;
    pixels[o + 1] = w > 0 ? onGrid((1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * 0.5 * viewport.height) : NaN;
  }
  return pixels;
}

/**
 * The constraints that a blade crosses: those that moved over its position between two frames, and
 * those that it then crosses along `path`.
 *
 * No constraint slips through, whatever the cloth does meanwhile. The particles move to their new places one
 * after the other, in the order of their indices, so an end of a constraint sweeps a triangle. Then the blade
 * moves. Each test is made of the sides of points to lines, which are the same for all constraints at
 * a particle, and exact: products of differences of multiples of PIXEL_GRAIN fit into the numbers.
 * @param {Float32Array} pixels from projectAll @param {Float32Array} past the same for the frame before
 * @param {Uint32Array} ends @param {Uint8Array} isGone @param {Pixel[]} path starts at the position of the blade
 */
export function crossedSticks(pixels, past, ends, isGone, path) {
  /** @type {number[]} */
  const crossed = [];
  const [at, ...stops] = path.map(({ x, y }) => ({ x: onGrid(x), y: onGrid(y) }));
  for (let i = 0; i < isGone.length; i++) {
    if (isGone[i]) continue;
    const a = 2 * Math.min(ends[2 * i], ends[2 * i + 1]), b = 2 * Math.max(ends[2 * i], ends[2 * i + 1]);
    if (Number.isNaN(pixels[a] + pixels[b] + past[a] + past[b])) continue;
    if (isSwept(pixels, past, a, b, at) || isCrossed(pixels, a, b, at, stops)) crossed.push(i);
  }
  return crossed;
}

/** True if a stick moves over a point: first its end a, then its end b. @param {Float32Array} pixels @param {Float32Array} past @param {number} a @param {number} b @param {Pixel} at */
function isSwept(pixels, past, a, b, { x, y }) {
  const ax = pixels[a], ay = pixels[a + 1], bx = pixels[b], by = pixels[b + 1];
  const oldAx = past[a], oldAy = past[a + 1], oldBx = past[b], oldBy = past[b + 1];
  if (Math.min(ax, bx, oldAx, oldBx) > x || Math.max(ax, bx, oldAx, oldBx) < x) return false;
  if (Math.min(ay, by, oldAy, oldBy) > y || Math.max(ay, by, oldAy, oldBy) < y) return false;
  const before = isLeft(oldAx, oldAy, oldBx, oldBy, x, y);
  const between = isLeft(ax, ay, oldBx, oldBy, x, y);
  const after = isLeft(ax, ay, bx, by, x, y);
  return (before !== between && isLeft(oldAx, oldAy, ax, ay, x, y) === between) || (between !== after && isLeft(oldBx, oldBy, bx, by, x, y) === between);
}

/** True if the blade crosses a stick on its way. @param {Float32Array} pixels @param {number} a @param {number} b @param {Pixel} at @param {Pixel[]} stops */
function isCrossed(pixels, a, b, at, stops) {
  const ax = pixels[a], ay = pixels[a + 1], bx = pixels[b], by = pixels[b + 1];
  let from = at;
  for (const to of stops) {
    if (isBoxApart(ax, bx, from.x, to.x) || isBoxApart(ay, by, from.y, to.y)) {
      from = to;
      continue;
    }
    if (segmentsCross(ax, ay, bx, by, from, to)) return true;
    from = to;
  }
  return false;
}

/** True if two intervals have no common point. @param {number} a @param {number} b @param {number} c @param {number} d */
const isBoxApart = (a, b, c, d) => Math.max(a, b) < Math.min(c, d) || Math.min(a, b) > Math.max(c, d);

/** True if a point lies left of the line from a to b; a point on the line counts as left.
 * @param {number} ax @param {number} ay @param {number} bx @param {number} by @param {number} x @param {number} y */
const isLeft = (ax, ay, bx, by, x, y) => (bx - ax) * (y - ay) >= (by - ay) * (x - ax);

/** True if each of two segments has its ends on both sides of the other.
 * @param {number} ax @param {number} ay @param {number} bx @param {number} by @param {Pixel} from @param {Pixel} to */
export function segmentsCross(ax, ay, bx, by, from, to) {
  return isLeft(from.x, from.y, to.x, to.y, ax, ay) !== isLeft(from.x, from.y, to.x, to.y, bx, by)
    && isLeft(ax, ay, bx, by, from.x, from.y) !== isLeft(ax, ay, bx, by, to.x, to.y);
}
