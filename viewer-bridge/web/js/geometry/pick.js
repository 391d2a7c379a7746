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

/** The CSS pixel of every particle, as x, y pairs; NaN behind the eye. @param {Points} points @param {Mat4} viewProjection @param {Viewport} viewport */
export function projectAll(points, viewProjection, viewport) {
  const m = frameToClip(viewProjection, points);
  const p = points.positions;
  const pixels = new Float32Array((p.length / 3) * 2);
  for (let i = 0, o = 0; i + 2 < p.length; i += 3, o += 2) {
    const x = p[i], y = p[i + 1], z = p[i + 2];
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    pixels[o] = w > 0 ? ((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) * 0.5 * viewport.width : NaN;
    pixels[o + 1] = w > 0 ? (1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * 0.5 * viewport.height : NaN;
  }
  return pixels;
}

/**
 * The constraints that a blade crosses: those that moved over its position between two frames, and
 * those that it then crosses along `path`.
 * @param {Float32Array} pixels from projectAll @param {Float32Array} past the same for the frame before
 * @param {Uint32Array} ends @param {Uint8Array} isGone @param {Pixel[]} path starts at the position of the blade
 */
export function crossedSticks(pixels, past, ends, isGone, path) {
  /** @type {number[]} */
  const crossed = [];
  const at = path[0];
  for (let i = 0; i < isGone.length; i++) {
    if (isGone[i]) continue;
    const a = 2 * ends[2 * i], b = 2 * ends[2 * i + 1];
    const ax = pixels[a], ay = pixels[a + 1], bx = pixels[b], by = pixels[b + 1];
    // Relative to the stick, the blade moved by the opposite of the motion of the stick's middle.
    const x = at.x + (ax - past[a] + bx - past[b]) / 2;
    const y = at.y + (ay - past[a + 1] + by - past[b + 1]) / 2;
    if (crosses(ax, ay, bx, by, { x, y }, at) || path.some((to, k) => k > 0 && crosses(ax, ay, bx, by, path[k - 1], to))) crossed.push(i);
  }
  return crossed;
}

/** segmentsCross behind a test of bounding boxes, which rules out most pairs. NaN passes the box test.
 * @param {number} ax @param {number} ay @param {number} bx @param {number} by @param {Pixel} from @param {Pixel} to */
function crosses(ax, ay, bx, by, from, to) {
  if ((ax < from.x && bx < from.x && ax < to.x && bx < to.x) || (ax > from.x && bx > from.x && ax > to.x && bx > to.x)) return false;
  if ((ay < from.y && by < from.y && ay < to.y && by < to.y) || (ay > from.y && by > from.y && ay > to.y && by > to.y)) return false;
  return segmentsCross(ax, ay, bx, by, from, to);
}

/** True if two segments cross. A touch counts; parallel segments never cross.
 * @param {number} ax @param {number} ay @param {number} bx @param {number} by @param {Pixel} from @param {Pixel} to */
export function segmentsCross(ax, ay, bx, by, from, to) {
  const sx = to.x - from.x, sy = to.y - from.y;
  const tx = bx - ax, ty = by - ay;
  const area = sx * ty - sy * tx;
  if (area === 0) return false;
  const along = ((ax - from.x) * ty - (ay - from.y) * tx) / area;
  const across = ((ax - from.x) * sy - (ay - from.y) * sx) / area;
  return along >= 0 && along <= 1 && across >= 0 && across <= 1;
}
