// What a scene holds on the graphics card: positions, the fans of triangles, the lists of what is
// drawn. Written when something has changed, and only what has.

import { drawnSticks } from "../topology.js";
import { ArrayTexture, layouts } from "./context.js";
import { Cloth } from "./cloth.js";
import { POINT, Points } from "./points.js";
import { Sticks } from "./sticks.js";
import { PIN } from "../wire.js";

/** @typedef {import("../wire.js").Frame} Frame */
/** @typedef {import("../state.js").Simulation} Simulation */

/** Sticks that are drawn at most: more are a grey carpet, and slow on weak machines. */
export const STICKS_MAX = 30_000;
/** Particles that are drawn as balls at most. */
export const PARTICLES_MAX = 60_000;

const NOTHING = new Uint32Array(0);

/** Programs by the kind of positions that they read. */
export class Drawers {
  /** @param {WebGL2RenderingContext} gl @param {boolean} isQuantised */
  constructor(gl, isQuantised) {
    this.isQuantised = isQuantised;
    this.cloth = new Cloth(gl, isQuantised);
    this.sticks = new Sticks(gl, isQuantised);
    this.points = new Points(gl, isQuantised);
  }

  /** Draws nothing any more, and gives back what the lists of a scene take. */
  clear() {
    this.cloth.setTriangles(NOTHING);
    this.sticks.clear();
    for (const list of [this.points.particles, this.points.marks, this.points.held]) list.set(NOTHING);
  }
}

export class SceneBuffers {
  /** @param {WebGL2RenderingContext} gl @param {Simulation} simulation @param {Drawers} drawers */
  constructor(gl, simulation, drawers) {
    this.gl = gl;
    this.simulation = simulation;
    this.drawers = drawers;
    const scene = simulation.scene;
    const topology = simulation.topology;
    if (scene === null || topology === null) throw new Error("no scene to draw");
    this.topology = topology;
    /** Another bridge may number its scenes alike: the same scene is the same object. */
    this.scene = scene;
    /** What lies between neighbours: the middle of the rest lengths. */
    this.spacing = medianLength(scene.restLengths, simulation.radius() * 0.5);
    const formats = layouts(gl);
    this.positions = new ArrayTexture(gl, 0, drawers.isQuantised ? formats.u16x3 : formats.f32x3, scene.particleCount);
    this.fanRanges = new ArrayTexture(gl, 1, formats.u32x2, scene.particleCount);
    this.fans = new ArrayTexture(gl, 2, formats.u32x4, scene.triangles.length);
    if (scene.particleCount > 0) this.fanRanges.write(topology.fanRanges);
    drawers.sticks.setSticks(scene, drawnSticks(scene, STICKS_MAX), topology.styles);
    this.writeTopology(true);
    this.writeParticles();
    this.writeMarks();
  }

  /** @param {Frame} frame */
  writePositions(frame) {
    if (frame.particleCount > 0) this.positions.write(frame.positions);
  }

  /** After a tear: which triangles and sticks are left, and the fans of those that died. @param {boolean} [isAll] */
  writeTopology(isAll = false) {
    const { topology, drawers, fans } = this;
    const { first, end } = isAll ? { first: 0, end: fans.count } : topology.dirtyFans.range();
    if (end > first) fans.write(topology.fans, first, end);
    topology.dirtyFans.clear();
    drawers.cloth.setTriangles(topology.indices);
    if (!isAll) drawers.sticks.setStyles(topology.styles);
  }

  /** All particles that have a position, those of a big scene up to a limit. */
  writeParticles() {
    const scene = /** @type {import("../wire.js").Scene} */ (this.simulation.scene);
    const lost = new Set(Array.from(this.simulation.nonFinite));
    const words = [];
    for (let particle = 0; particle < Math.min(scene.particleCount, PARTICLES_MAX); particle++) {
      if (!lost.has(particle)) words.push(particle, POINT.particle);
    }
    this.drawers.points.particles.set(new Uint32Array(words));
  }

  /** What does not move freely, and why; what hands hold apart from the rest. */
  writeMarks() {
    const { points } = this.drawers;
    const looks = [...this.simulation.pins].map(([particle, flags]) => [particle, lookOf(flags)]);
    const isHeld = (/** @type {number[]} */ [, look]) => look === POINT.held;
    points.marks.set(new Uint32Array(looks.filter((one) => !isHeld(one)).flat()));
    points.held.set(new Uint32Array(looks.filter(isHeld).flat()));
  }

  delete() {
    for (const texture of [this.positions, this.fanRanges, this.fans]) texture.delete();
    this.drawers.clear();
  }
}

/** What holds first, as the node has it: a hand before a pin, a pin before an anchor. @param {number} flags */
function lookOf(flags) {
  if (flags & PIN.frozen) return POINT.frozen;
  if (flags & PIN.grabbed) return POINT.held;
  return flags & PIN.pinned ? POINT.pin : POINT.anchor;
}

/** @param {Float32Array} lengths @param {number} fallback */
function medianLength(lengths, fallback) {
  if (lengths.length === 0) return fallback;
  // A sample is enough for the width of a line.
  const sample = lengths.filter((_, index) => index % Math.ceil(lengths.length / 500) === 0).sort();
  return sample[sample.length >> 1];
}
