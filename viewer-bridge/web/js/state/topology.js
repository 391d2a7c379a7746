// The topology of a scene, and which parts of it are intact: the triangles and sticks that are drawn,
// and the fan of triangles around each particle that gives its normal.

import { CONSTRAINT } from "../net/wire.js";

/** @typedef {import("../net/wire.js").Scene} Scene */

/** No constraint joins these corners. */
const NONE = -1;
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
    /** Constraint along each edge of each triangle, or NONE: 3 t. */
    this.edgeConstraints = edgeConstraints(scene);
    const { starts, triangles } = trianglesOf(this.edgeConstraints, scene.constraintCount);
    /** Triangles along constraint i: edgeTriangles[edgeStarts[i] .. edgeStarts[i + 1]]. */
    this.edgeStarts = starts;
    this.edgeTriangles = triangles;
    const fans = buildFans(scene, this.edgeConstraints);
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
      const isCovered = this.edgeStarts[i + 1] > this.edgeStarts[i];
      this.styles[i] = this.scene.constraintKinds[i] | (isCovered ? STICK.isCovered : 0);
    }
    for (let corner = 0; corner < this.fanEntries.length; corner++) this.writeFanEntry(corner);
    this.indices.set(this.scene.triangles);
  }

  /** Removes constraints, and the triangles along them. @param {ArrayLike<number>} constraints */
  remove(constraints) {
    for (let k = 0; k < constraints.length; k++) {
      const i = constraints[k];
      if (i >= this.isGone.length || this.isGone[i]) continue;
      this.isGone[i] = 1;
      this.styles[i] |= STICK.isGone;
      for (let e = this.edgeStarts[i]; e < this.edgeStarts[i + 1]; e++) this.kill(this.edgeTriangles[e]);
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
      this.fans[entry + 2] = 0;
      this.dirtyFans.add(this.fanEntries[corner]);
      this.uncover(this.edgeConstraints[corner]);
    }
  }

  /** Draws a constraint as a stick once no triangle covers it. @param {number} constraint */
  uncover(constraint) {
    if (constraint === NONE) return;
    for (let e = this.edgeStarts[constraint]; e < this.edgeStarts[constraint + 1]; e++) {
      if (!this.isDead[this.edgeTriangles[e]]) return;
    }
    this.styles[constraint] &= ~STICK.isCovered;
  }

  /** @param {number} corner */
  writeFanEntry(corner) {
    const { triangles, restLengths } = this.scene;
    const first = corner - (corner % 3);
    const entry = this.fanEntries[corner] * FAN_WORDS;
    const constraint = this.edgeConstraints[corner];
    this.fans[entry] = triangles[first + ((corner + 1) % 3)];
    this.fans[entry + 1] = triangles[first + ((corner + 2) % 3)];
    this.fans[entry + 2] = constraint === NONE ? 0 : floatBits(restLengths[constraint]);
    this.fans[entry + 3] = 0;
    this.dirtyFans.add(this.fanEntries[corner]);
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

/** The constraint along each edge of each triangle. Edge k of a triangle runs from corner k to the next.
 * @param {Scene} scene */
function edgeConstraints(scene) {
  const { ends, triangles, particleCount } = scene;
  const constraintOf = new Map();
  const key = (/** @type {number} */ a, /** @type {number} */ b) => Math.min(a, b) * particleCount + Math.max(a, b);
  if (triangles.length > 0) for (let i = 0; i < ends.length / 2; i++) constraintOf.set(key(ends[2 * i], ends[2 * i + 1]), i);
  const edges = new Int32Array(triangles.length);
  for (let corner = 0; corner < triangles.length; corner++) {
    const next = corner - (corner % 3) + ((corner + 1) % 3);
    edges[corner] = constraintOf.get(key(triangles[corner], triangles[next])) ?? NONE;
  }
  return edges;
}

/** The triangles along each constraint, as concatenated lists with their starts. @param {Int32Array} edges @param {number} constraintCount */
function trianglesOf(edges, constraintCount) {
  const starts = new Uint32Array(constraintCount + 1);
  for (const constraint of edges) if (constraint !== NONE) starts[constraint + 1]++;
  for (let i = 0; i < constraintCount; i++) starts[i + 1] += starts[i];
  const next = starts.slice();
  const triangles = new Uint32Array(starts[constraintCount]);
  edges.forEach((constraint, corner) => {
    if (constraint !== NONE) triangles[next[constraint]++] = Math.floor(corner / 3);
  });
  return { starts, triangles };
}

/** Allocates a contiguous run of entries per particle, and an entry of it per corner. @param {Scene} scene @param {Int32Array} edges */
function buildFans(scene, edges) {
  const { triangles, particleCount } = scene;
  const ranges = new Uint32Array(2 * particleCount);
  for (const particle of triangles) ranges[2 * particle + 1]++;
  for (let p = 1; p < particleCount; p++) ranges[2 * p] = ranges[2 * p - 2] + ranges[2 * p - 1];
  const used = new Uint32Array(particleCount);
  const entryByCorner = new Uint32Array(edges.length);
  triangles.forEach((particle, corner) => {
    entryByCorner[corner] = ranges[2 * particle] + used[particle]++;
  });
  return { ranges, entryByCorner, entries: new Uint32Array(edges.length * FAN_WORDS) };
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
