// The topology of a scene, and which parts of it are intact: the triangles and sticks that are drawn,
// and the fan of triangles around each particle that gives its normal.

import { CONSTRAINT } from "../net/wire.js";
import { strainGains } from "./quantity.js";
import { floatBits, nextCorner, splitPieces } from "./splits.js";

/** @typedef {import("../net/wire.js").Scene} Scene */

/** Words of a fan entry: two corners, the rest length to the first and the gain as f32 bits. */
export const FAN_WORDS = 4;

/** Bits of the style of a stick, as the shader reads them. */
export const STICK = Object.freeze({
  kindMask: 3,
  /** The edge of an intact triangle: the surface shows it already. */
  isCovered: 4,
  isGone: 8,
});

export class Topology {
  /** @param {Scene} scene */
  constructor(scene) {
    this.scene = scene;
    /** Constraints along the edge from each corner to the next, structural ones first. */
    this.edgeConstraints = edgeConstraints(scene);
    /** Corners whose edges lie along each constraint. */
    this.edgeCorners = this.edgeConstraints.inverse(scene.constraintCount);
    const fans = buildFans(scene);
    /** Start and length of the fan of each particle: 2 n. */
    this.fanRanges = fans.ranges;
    /** Entries of FAN_WORDS words, one per corner of each triangle. */
    this.fans = fans.entries;
    /** Index of the entry of each corner: 3 t. */
    this.fanEntries = fans.entryByCorner;
    this.cornerByEntry = fans.cornerByEntry;
    /** Triangles that are not drawn as a whole: gone, or in pieces. */
    this.isDead = new Uint8Array(scene.triangleCount);
    /** Triangles with a torn edge, which are drawn in pieces. @type {Set<number>} */
    this.split = new Set();
    /** Corners of the triangles. Those of dead triangles are all 0: a triangle without area draws nothing. */
    this.indices = new Uint32Array(scene.triangles.length);
    /** Fan entries not uploaded yet. */
    this.dirtyFans = new DirtyRange();
    /** Gains of the quantity that colours the picture; see quantity.js. @type {Float32Array} */
    this.gains = strainGains(scene);
    this.isGone = new Uint8Array(scene.constraintCount);
    this.styles = new Uint8Array(scene.constraintCount);
    this.restore();
  }

  /** Restores every constraint and triangle. */
  restore() {
    this.isDead.fill(0);
    this.split.clear();
    this.isGone.fill(0);
    for (let i = 0; i < this.styles.length; i++) {
      const isCovered = this.edgeCorners.starts[i + 1] > this.edgeCorners.starts[i];
      this.styles[i] = this.scene.constraintKinds[i] | (isCovered ? STICK.isCovered : 0);
    }
    for (let corner = 0; corner < this.fanEntries.length; corner++) this.writeFanEntry(corner);
    this.indices.set(this.scene.triangles);
  }

  /** Colours by another quantity of the constraints. @param {Float32Array} gains */
  setGains(gains) {
    this.gains = gains;
    for (let corner = 0; corner < this.fanEntries.length; corner++) this.writeRestLength(corner);
  }

  /** Removes constraints, and splits the triangles with a torn side. @param {ArrayLike<number>} constraints */
  remove(constraints) {
    for (let k = 0; k < constraints.length; k++) {
      const i = constraints[k];
      if (i >= this.isGone.length || this.isGone[i]) continue;
      this.isGone[i] = 1;
      this.styles[i] |= STICK.isGone;
      for (const corner of this.edgeCorners.at(i)) {
        if (this.isTornSide(corner)) {
          this.kill(triangleOf(corner));
          this.split.add(triangleOf(corner));
        } else this.writeRestLength(corner);
      }
    }
  }

  /** Removes the constraints and triangles of particles without a position. @param {Uint32Array} particles */
  removeAround(particles) {
    if (particles.length === 0) return;
    const lost = new Set(particles);
    const { ends, triangles } = this.scene;
    /** @type {number[]} */
    const constraints = [];
    for (let i = 0; i < ends.length / 2; i++) if (lost.has(ends[2 * i]) || lost.has(ends[2 * i + 1])) constraints.push(i);
    this.remove(constraints);
    for (let t = 0; t < triangles.length / 3; t++) {
      if (!lost.has(triangles[3 * t]) && !lost.has(triangles[3 * t + 1]) && !lost.has(triangles[3 * t + 2])) continue;
      this.kill(t);
      this.split.delete(t);
    }
  }

  /** The vertices and indices of the pieces of split triangles, as `splitPieces` returns them. @param {(triangle: number) => boolean} isDrawn */
  pieces(isDrawn = () => true) {
    const { triangles, particleCount } = this.scene;
    const cornersAt = (/** @type {number} */ particle) => this.cornerByEntry.subarray(this.fanRanges[2 * particle], this.fanRanges[2 * particle] + this.fanRanges[2 * particle + 1]);
    const isTorn = (/** @type {number} */ corner) => this.isTornEdge(corner, cornersAt);
    const restLength = (/** @type {number} */ corner) => this.restLength(corner);
    return splitPieces({ triangles, cornersAt, isTorn, restLength }, [...this.split].filter(isDrawn), particleCount);
  }

  /** True if the edge from a corner to the next is torn. An edge without constraints holds as long as a
   * triangle beside it does. @param {number} corner @param {(particle: number) => Uint32Array} cornersAt */
  isTornEdge(corner, cornersAt) {
    const { triangles } = this.scene;
    if (this.edgeConstraints.at(corner).length > 0) return this.isTornSide(corner);
    const [a, b] = [triangles[corner], triangles[nextCorner(corner)]];
    const beside = [corner, ...[a, b].flatMap((one) => [...cornersAt(one)].filter((other) => other !== corner && isBetween(triangles, other, a, b)))];
    return beside.every((one) => [nextCorner(one), nextCorner(nextCorner(one))].some((other) => this.isTornSide(other)));
  }

  /** True if constraints join the ends of the edge from a corner to the next, and all of them are gone: the solver's rule
   * (TornSides in sim-node/scene/src/constraints/sides.rs), by which such a triangle catches no wind and touches nothing. @param {number} corner */
  isTornSide(corner) {
    const members = this.edgeConstraints.at(corner);
    return members.length > 0 && members.every((one) => this.isGone[one] === 1);
  }

  /** Rest length of an edge, or its length in the scene without a constraint. @param {number} corner */
  restLength(corner) {
    const { triangles, positions: p, restLengths } = this.scene;
    const members = this.edgeConstraints.at(corner);
    if (members.length > 0) return restLengths[members[0]];
    const [a, b] = [3 * triangles[corner], 3 * triangles[nextCorner(corner)]];
    return Math.hypot(p[a] - p[b], p[a + 1] - p[b + 1], p[a + 2] - p[b + 2]);
  }

  /** @param {number} triangle */
  kill(triangle) {
    if (this.isDead[triangle]) return;
    this.isDead[triangle] = 1;
    this.indices.fill(0, 3 * triangle, 3 * triangle + 3);
    for (let corner = 3 * triangle; corner < 3 * triangle + 3; corner++) {
      // Equal corners have no area, so they do not contribute to a normal.
      const entry = this.fanEntries[corner] * FAN_WORDS;
      this.fans[entry + 1] = this.fans[entry];
      this.writeRestLength(corner);
      for (const constraint of this.edgeConstraints.at(corner)) this.uncover(constraint);
    }
  }

  /** Draws a constraint as a stick once no triangle covers it. @param {number} constraint */
  uncover(constraint) {
    for (const corner of this.edgeCorners.at(constraint)) if (!this.isDead[triangleOf(corner)]) return;
    this.styles[constraint] &= ~STICK.isCovered;
  }

  /** @param {number} corner */
  writeFanEntry(corner) {
    const { triangles } = this.scene;
    const entry = this.fanEntries[corner] * FAN_WORDS;
    this.fans[entry] = triangles[nextCorner(corner)];
    this.fans[entry + 1] = triangles[nextCorner(nextCorner(corner))];
    this.writeRestLength(corner);
  }

  /** Writes the rest length and the gain of the first intact constraint along an edge; 0 without one, or if the triangle is dead. @param {number} corner */
  writeRestLength(corner) {
    // This runs for every corner of a scene at once, so it creates no views.
    const { starts, members } = this.edgeConstraints;
    const end = this.isDead[triangleOf(corner)] ? starts[corner] : starts[corner + 1];
    let k = starts[corner];
    while (k < end && this.isGone[members[k]]) k++;
    const entry = this.fanEntries[corner];
    this.fans[entry * FAN_WORDS + 2] = k < end ? floatBits(this.scene.restLengths[members[k]]) : 0;
    this.fans[entry * FAN_WORDS + 3] = k < end ? floatBits(this.gains[members[k]]) : 0;
    this.dirtyFans.add(entry);
  }
}

/** @param {number} corner */
const triangleOf = (corner) => Math.floor(corner / 3);
/** True if the edge of a corner lies between two particles. @param {ArrayLike<number>} triangles @param {number} corner @param {number} a @param {number} b */
const isBetween = (triangles, corner, a, b) => {
  const [from, to] = [triangles[corner], triangles[nextCorner(corner)]];
  return (from === a && to === b) || (from === b && to === a);
};

/** Lists of numbers, concatenated. */
class Lists {
  /** @param {Uint32Array} starts one more than there are lists @param {Uint32Array} members */
  constructor(starts, members) {
    this.starts = starts;
    this.members = members;
  }

  /** @param {number} list */
  at(list) {
    return this.members.subarray(this.starts[list], this.starts[list + 1]);
  }

  /** For each number below `count`, the lists that contain it. @param {number} count */
  inverse(count) {
    const starts = new Uint32Array(count + 1);
    for (const member of this.members) starts[member + 1]++;
    for (let i = 0; i < count; i++) starts[i + 1] += starts[i];
    const next = starts.slice();
    const members = new Uint32Array(this.members.length);
    for (let list = 0; list + 1 < this.starts.length; list++) {
      for (let k = this.starts[list]; k < this.starts[list + 1]; k++) members[next[this.members[k]]++] = list;
    }
    return new Lists(starts, members);
  }
}

/** The smallest range of indices that contains all added ones. */
class DirtyRange {
  constructor() {
    this.first = Infinity;
    this.last = -Infinity;
  }

  /** @param {number} index */
  add(index) {
    if (index < this.first) this.first = index;
    if (index > this.last) this.last = index;
  }

  /** Half-open range, empty if nothing was added. */
  range() {
    return this.last < this.first ? { first: 0, end: 0 } : { first: this.first, end: this.last + 1 };
  }

  clear() {
    this.first = Infinity;
    this.last = -Infinity;
  }
}

/** The constraints along the edge from each corner of each triangle to the next. Structural ones come first, then by index.
 * @param {Scene} scene */
function edgeConstraints(scene) {
  const { ends, triangles, constraintKinds, constraintCount, particleCount } = scene;
  const NONE = -1;
  const key = (/** @type {number} */ a, /** @type {number} */ b) => Math.min(a, b) * particleCount + Math.max(a, b);
  // A linked list per edge: each constraint is put in front of those before it.
  /** @type {Map<number, number>} */
  const heads = new Map();
  const following = new Int32Array(constraintCount).fill(NONE);
  for (const isStructural of triangles.length > 0 ? [false, true] : []) {
    for (let i = constraintCount - 1; i >= 0; i--) {
      if ((constraintKinds[i] === CONSTRAINT.structural) !== isStructural) continue;
      const edge = key(ends[2 * i], ends[2 * i + 1]);
      following[i] = heads.get(edge) ?? NONE;
      heads.set(edge, i);
    }
  }
  const starts = new Uint32Array(triangles.length + 1);
  /** @type {number[]} */
  const members = [];
  for (let corner = 0; corner < triangles.length; corner++) {
    const head = heads.get(key(triangles[corner], triangles[nextCorner(corner)])) ?? NONE;
    for (let i = head; i !== NONE; i = following[i]) members.push(i);
    starts[corner + 1] = members.length;
  }
  return new Lists(starts, Uint32Array.from(members));
}

/** Allocates a contiguous run of entries per particle, and an entry of it per corner. @param {Scene} scene */
function buildFans(scene) {
  const { triangles, particleCount } = scene;
  const ranges = new Uint32Array(2 * particleCount);
  for (const particle of triangles) ranges[2 * particle + 1]++;
  for (let p = 1; p < particleCount; p++) ranges[2 * p] = ranges[2 * p - 2] + ranges[2 * p - 1];
  const used = new Uint32Array(particleCount);
  const entryByCorner = new Uint32Array(triangles.length);
  const cornerByEntry = new Uint32Array(triangles.length);
  triangles.forEach((particle, corner) => {
    const entry = ranges[2 * particle] + used[particle]++;
    entryByCorner[corner] = entry;
    cornerByEntry[entry] = corner;
  });
  return { ranges, entryByCorner, cornerByEntry, entries: new Uint32Array(triangles.length * FAN_WORDS) };
}

/**
 * The constraints that are drawn as sticks, at most `limit`: first structural, then shear, tether and bend.
 * Bend constraints lie along or across other sticks and would hide them, so only the colours of kinds show them.
 * @param {Scene} scene @param {number} limit
 */
export function drawnSticks(scene, limit) {
  /** @type {number[]} */
  const drawn = [];
  for (const kind of [CONSTRAINT.structural, CONSTRAINT.shear, CONSTRAINT.tether, CONSTRAINT.bend]) {
    for (let i = 0; i < scene.constraintCount && drawn.length < limit; i++) {
      if (scene.constraintKinds[i] === kind) drawn.push(i);
    }
  }
  return Uint32Array.from(drawn);
}
