// The topology of a scene, and which parts of it are intact: the triangles and sticks that are drawn,
// and the fan of triangles around each particle that gives its normal.

import { CONSTRAINT } from "../net/wire.js";

/** @typedef {import("../net/wire.js").Scene} Scene */

/** Words of a fan entry: two corners, the rest length to the first as f32 bits, and 0. */
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
    this.isDead = new Uint8Array(scene.triangleCount);
    /** Corners of the triangles. Those of dead triangles are all 0: a triangle without area draws nothing. */
    this.indices = new Uint32Array(scene.triangles.length);
    /** Fan entries not uploaded yet. */
    this.dirtyFans = new DirtyRange();
    this.isGone = new Uint8Array(scene.constraintCount);
    this.styles = new Uint8Array(scene.constraintCount);
    this.restore();
  }

  /** Restores every constraint and triangle. */
  restore() {
    this.isDead.fill(0);
    this.isGone.fill(0);
    for (let i = 0; i < this.styles.length; i++) {
      const isCovered = this.edgeCorners.starts[i + 1] > this.edgeCorners.starts[i];
      this.styles[i] = this.scene.constraintKinds[i] | (isCovered ? STICK.isCovered : 0);
    }
    for (let corner = 0; corner < this.fanEntries.length; corner++) this.writeFanEntry(corner);
    this.indices.set(this.scene.triangles);
  }

  /** Removes constraints, and the triangles along structural ones. @param {ArrayLike<number>} constraints */
  remove(constraints) {
    for (let k = 0; k < constraints.length; k++) {
      const i = constraints[k];
      if (i >= this.isGone.length || this.isGone[i]) continue;
      this.isGone[i] = 1;
      this.styles[i] |= STICK.isGone;
      const isStructural = this.scene.constraintKinds[i] === CONSTRAINT.structural;
      for (const corner of this.edgeCorners.at(i)) {
        if (isStructural) this.kill(triangleOf(corner));
        else this.writeRestLength(corner);
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
      if (lost.has(triangles[3 * t]) || lost.has(triangles[3 * t + 1]) || lost.has(triangles[3 * t + 2])) this.kill(t);
    }
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
    this.fans[entry + 3] = 0;
    this.writeRestLength(corner);
  }

  /** Writes the rest length of the first intact constraint along an edge; 0 without one, or if the triangle is dead. @param {number} corner */
  writeRestLength(corner) {
    // This runs for every corner of a scene at once, so it creates no views.
    const { starts, members } = this.edgeConstraints;
    const end = this.isDead[triangleOf(corner)] ? starts[corner] : starts[corner + 1];
    let k = starts[corner];
    while (k < end && this.isGone[members[k]]) k++;
    const entry = this.fanEntries[corner];
    this.fans[entry * FAN_WORDS + 2] = k < end ? floatBits(this.scene.restLengths[members[k]]) : 0;
    this.dirtyFans.add(entry);
  }
}

/** @param {number} corner */
const triangleOf = (corner) => Math.floor(corner / 3);
/** The next corner of the same triangle. @param {number} corner */
const nextCorner = (corner) => corner - (corner % 3) + ((corner + 1) % 3);

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

const scratch = new DataView(new ArrayBuffer(4));

/** @param {number} value */
function floatBits(value) {
  scratch.setFloat32(0, value);
  return scratch.getUint32(0);
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
  triangles.forEach((particle, corner) => {
    entryByCorner[corner] = ranges[2 * particle] + used[particle]++;
  });
  return { ranges, entryByCorner, entries: new Uint32Array(triangles.length * FAN_WORDS) };
}

/**
 * The constraints that are drawn as sticks, at most `limit`: first structural, then shear, then tether.
 * Bend constraints lie along or across other sticks and would only hide them.
 * @param {Scene} scene @param {number} limit
 */
export function drawnSticks(scene, limit) {
  /** @type {number[]} */
  const drawn = [];
  for (const kind of [CONSTRAINT.structural, CONSTRAINT.shear, CONSTRAINT.tether]) {
    for (let i = 0; i < scene.constraintCount && drawn.length < limit; i++) {
      if (scene.constraintKinds[i] === kind) drawn.push(i);
    }
  }
  return Uint32Array.from(drawn);
}
