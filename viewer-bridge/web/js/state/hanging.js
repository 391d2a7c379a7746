// The lowest height that a scene can hang to: the first view has room for it.

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../net/wire.js").Scene} Scene */

/** Limit on sweeps. A few suffice, because scenes number their particles in order. */
const SWEEPS_MAX = 40;
/** Limit on particles for the analysis between the outermost pins. */
const BETWEEN_PINS_MAX = 5000;
/** Number of samples between two pins in the search for the lowest point. */
const SAMPLES = 16;

/**
 * The lowest height that any particle can hang at; null if some particle hangs from nothing.
 *
 * The distance of a particle from a pin is at most d, the length of the shortest path along
 * constraints. So its height is at least height - d for each pin, and for two pins it lies in the
 * intersection of both balls.
 * @param {Scene} scene @param {ArrayLike<number>} pins particles that do not fall @param {Vec3} up
 */
export function lowestReach(scene, pins, up) {
  if (pins.length === 0) return null;
  const height = (/** @type {number} */ p) => along(scene, p, up);
  const lowest = sweep(scene, Array.from(pins, (p) => [p, height(p)]));
  if (scene.particleCount <= BETWEEN_PINS_MAX) {
    for (const pair of outermostPairs(scene, pins, up)) raiseBetween(scene, pair, up, lowest);
  }
  const least = lowest.reduce((a, b) => Math.min(a, b), Infinity);
  return Number.isFinite(least) ? least : null;
}

/** @param {Scene} scene @param {number} p @param {Vec3} axis */
const along = ({ positions }, p, axis) => positions[3 * p] * axis[0] + positions[3 * p + 1] * axis[1] + positions[3 * p + 2] * axis[2];

/** For each particle, the maximum of (value - path length) over all sources. @param {Scene} scene @param {number[][]} sources particle, value */
function sweep(scene, sources) {
  const { ends, restLengths, constraintCount } = scene;
  const best = new Float64Array(scene.particleCount).fill(-Infinity);
  for (const [particle, value] of sources) best[particle] = value;
  const relax = (/** @type {number} */ i) => {
    const a = ends[2 * i];
    const b = ends[2 * i + 1];
    const fromA = best[a] - restLengths[i];
    const fromB = best[b] - restLengths[i];
    if (fromA > best[b]) best[b] = fromA;
    else if (fromB > best[a]) best[a] = fromB;
    else return 0;
    return 1;
  };
  for (let round = 0, changes = 1; changes > 0 && round < SWEEPS_MAX; round++) {
    changes = 0;
    for (let i = 0; i < constraintCount; i++) changes += relax(i);
    for (let i = constraintCount - 1; i >= 0; i--) changes += relax(i);
  }
  return best;
}

/** The two pins that are farthest apart along each horizontal axis. @param {Scene} scene @param {ArrayLike<number>} pins @param {Vec3} up */
function outermostPairs(scene, pins, up) {
  const axes = /** @type {Vec3[]} */ ([[1, 0, 0], [0, 1, 0], [0, 0, 1]]).filter((axis) => axis.every((one, k) => one * up[k] === 0));
  return axes.map((axis) => {
    const sorted = Array.from(pins).sort((a, b) => along(scene, a, axis) - along(scene, b, axis));
    return [sorted[0], sorted[sorted.length - 1]];
  }).filter(([first, last]) => first !== last);
}

/** Raises the lower bounds of particles that hang between two pins. @param {Scene} scene @param {number[]} pair @param {Vec3} up @param {Float64Array} lowest */
function raiseBetween(scene, [first, last], up, lowest) {
  const { positions } = scene;
  const rise = along(scene, last, up) - along(scene, first, up);
  const apart = Math.hypot(...[0, 1, 2].map((k) => positions[3 * last + k] - positions[3 * first + k]));
  const level = Math.sqrt(Math.max(0, apart * apart - rise * rise));
  const fromFirst = sweep(scene, [[first, 0]]);
  const fromLast = sweep(scene, [[last, 0]]);
  for (let p = 0; p < lowest.length; p++) {
    const under = lowestWithin(-fromFirst[p], -fromLast[p], level, rise);
    if (under !== null) lowest[p] = Math.max(lowest[p], along(scene, first, up) + under);
  }
}

/** The lowest height in the intersection of two balls, relative to the first pin: radius a around that
 * pin, and radius b around the other pin, `level` away and `rise` higher. Null if no sample is in both.
 * @param {number} a @param {number} b @param {number} level @param {number} rise */
export function lowestWithin(a, b, level, rise) {
  let least = Infinity;
  const from = Math.max(-a, level - b);
  const to = Math.min(a, level + b);
  if (!(from <= to) || !Number.isFinite(from) || !Number.isFinite(to)) return null;
  for (let sample = 0; sample <= SAMPLES; sample++) {
    const s = from + ((to - from) * sample) / SAMPLES;
    const underFirst = -Math.sqrt(Math.max(0, a * a - s * s));
    const underLast = rise - Math.sqrt(Math.max(0, b * b - (level - s) * (level - s)));
    least = Math.min(least, Math.max(underFirst, underLast));
  }
  return least;
}
