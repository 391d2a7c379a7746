// GPU resources of a scene: positions, triangle fans, and the lists of triangles, sticks and points.
// Each is uploaded only when it has changed.

import { bodyRadii, bridgeTriangles, planksOf } from "../state/shapes.js";
import { drawnSticks } from "../state/topology.js";
import { layFlat } from "../state/weave.js";
import { ArrayTexture, UNITS, layouts } from "./context.js";
import { Cloth } from "./particles/cloth.js";
import { Planks } from "./particles/planks.js";
import { GhostSticks, Sticks } from "./particles/sticks.js";
import { POINT, Points } from "./particles/points.js";
import { PIN } from "../net/wire.js";

/** @typedef {import("../net/wire.js").Frame} Frame */
/** @typedef {import("../state/simulation.js").Simulation} Simulation */

/** Limit on drawn sticks: more merge into grey, and are slow on weak machines. */
export const STICKS_MAX = 30_000;
/** Limit on particles drawn as balls. */
export const PARTICLES_MAX = 60_000;

const EMPTY = new Uint32Array(0);

/** Everything that is drawn from particle positions, for one variant of the shaders. */
export class Drawables {
  /** @param {WebGL2RenderingContext} gl @param {import("./context.js").Variant} variant */
  constructor(gl, variant) {
    this.gl = gl;
    this.variant = variant;
    this.cloth = new Cloth(gl, variant);
    this.sticks = new Sticks(gl, variant);
    this.points = new Points(gl, variant.isQuantised);
    /** Created for the first scene that has any. @type {Planks | null} */
    this.planks = null;
  }

  /** @param {import("../state/shapes.js").Plank[]} planks @param {Uint8Array} styles of all constraints */
  setPlanks(planks, styles) {
    if (planks.length > 0) this.planks ??= new Planks(this.gl, this.variant);
    this.planks?.set(planks, styles);
  }

  /** Empties all lists, and frees their memory. */
  clear() {
    this.cloth.setTriangles(EMPTY, EMPTY);
    this.sticks.clear();
    this.setPlanks([], new Uint8Array(0));
    for (const list of [this.points.particles, this.points.marks, this.points.grabbed]) list.set(EMPTY);
  }
}

export class SceneBuffers {
  /** @param {WebGL2RenderingContext} gl @param {Simulation} simulation @param {Drawables} drawables */
  constructor(gl, simulation, drawables) {
    this.gl = gl;
    this.simulation = simulation;
    this.drawables = drawables;
    const scene = simulation.scene;
    const topology = simulation.topology;
    if (scene === null || topology === null) throw new Error("no scene to draw");
    this.topology = topology;
    /** Compared by identity: the epochs of two bridges may be equal. */
    this.scene = scene;
    /** Typical distance between neighbours: the median of the rest lengths. */
    this.spacing = medianLength(scene.restLengths, simulation.radius() * 0.5);
    const formats = layouts(gl);
    this.positions = new ArrayTexture(gl, UNITS.u_positions, drawables.variant.isQuantised ? formats.u16x3 : formats.f32x3, scene.particleCount);
    this.fanRanges = new ArrayTexture(gl, UNITS.u_fan_ranges, formats.u32x2, scene.particleCount);
    this.fans = new ArrayTexture(gl, UNITS.u_fans, formats.u32x4, scene.triangles.length);
    /** Vertices of the pieces of split triangles; see SPLIT_WORDS. @type {ArrayTexture} */
    this.splits = new ArrayTexture(gl, UNITS.u_splits, formats.u32x4, 0);
    /** Speeds of the particles; empty until they colour the picture. */
    this.speeds = new ArrayTexture(gl, UNITS.u_speeds, formats.f32x1, 0);
    if (scene.particleCount > 0) this.fanRanges.write(topology.fanRanges);
    const { hasEffects } = drawables.variant;
    this.planks = hasEffects ? planksOf(scene) : [];
    /** Triangles in place of which planks are drawn; null without any. */
    this.hidden = this.planks.length > 0 ? bridgeTriangles(scene) : null;
    /** Places of the particles in the surface laid flat. @type {ArrayTexture | null} */
    this.flatPlaces = hasEffects ? new ArrayTexture(gl, UNITS.u_flat_places, formats.f32x2, scene.particleCount) : null;
    if (scene.particleCount > 0) this.flatPlaces?.write(layFlat(topology));
    drawables.sticks.setSticks(topology, drawnSticks(scene, STICKS_MAX), hasEffects ? this.radii() : new Float32Array(scene.constraintCount));
    /** Typical distance between neighbouring marks. */
    this.markGap = Infinity;
    /** Created for the first state of a ghost. @type {GhostSticks | null} */
    this.ghost = null;
    this.writeTopology(true);
    this.writeParticles();
    this.writeMarks();
  }

  /** The radii of ropes and limbs. */
  radii() {
    const { parameters } = this.simulation;
    const contact = parameters?.initial?.["contact.thickness"] ?? null;
    return bodyRadii(this.scene, { contact: typeof contact === "number" ? contact : null, sceneRadius: this.simulation.radius() });
  }

  /** @param {Frame} frame */
  writePositions(frame) {
    if (frame.particleCount > 0) this.positions.write(frame.positions);
  }

  /** @param {import("../net/wire.js").Ghost} ghost @param {() => Sticks} sticksOf returns the sticks for ghosts */
  writeGhost(ghost, sticksOf) {
    if (ghost.positions.length !== 3 * this.scene.particleCount) return;
    this.ghost ??= new GhostSticks(this.gl, sticksOf(), this.topology, STICKS_MAX);
    this.ghost.write(ghost);
  }

  /** @param {Float32Array} speeds */
  writeSpeeds(speeds) {
    if (this.speeds.count !== speeds.length) {
      this.speeds.delete();
      this.speeds = new ArrayTexture(this.gl, UNITS.u_speeds, layouts(this.gl).f32x1, speeds.length);
    }
    if (speeds.length > 0) this.speeds.write(speeds);
  }

  /** Uploads the intact triangles and sticks, and the changed fan entries. @param {boolean} [isAll] */
  writeTopology(isAll = false) {
    const { topology, drawables, fans, hidden } = this;
    const { first, end } = isAll ? { first: 0, end: fans.count } : topology.dirtyFans.range();
    if (end > first) fans.write(topology.fans, first, end);
    topology.dirtyFans.clear();
    const { vertices, indices } = topology.pieces((triangle) => hidden === null || hidden[triangle] === 0);
    this.splits.delete();
    this.splits = new ArrayTexture(this.gl, UNITS.u_splits, layouts(this.gl).u32x4, vertices.length / 4);
    this.splits.write(vertices);
    drawables.cloth.setTriangles(hidden === null ? topology.indices : topology.indices.map((particle, corner) => (hidden[Math.floor(corner / 3)] ? 0 : particle)), indices);
    drawables.setPlanks(this.planks, topology.styles);
    if (!isAll) drawables.sticks.update(topology);
  }

  /** Lists the particles that have a position, up to a limit. */
  writeParticles() {
    const scene = /** @type {import("../net/wire.js").Scene} */ (this.simulation.scene);
    const lost = new Set(Array.from(this.simulation.nonFinite));
    const words = [];
    for (let particle = 0; particle < Math.min(scene.particleCount, PARTICLES_MAX); particle++) {
      if (!lost.has(particle)) words.push(particle, POINT.particle);
    }
    this.drawables.points.particles.set(new Uint32Array(words));
  }

  /** Lists the marks of particles that are not free. Grabbed particles have their own list. */
  writeMarks() {
    const { points } = this.drawables;
    const marks = [...this.simulation.pins].map(([particle, flags]) => [particle, markStyle(flags)]);
    this.markGap = gapOf(this.scene.positions, [...this.simulation.pins.keys()]);
    const isGrabbed = (/** @type {number[]} */ [, style]) => style === POINT.grabbed;
    points.marks.set(new Uint32Array(marks.filter((mark) => !isGrabbed(mark)).flat()));
    points.grabbed.set(new Uint32Array(marks.filter(isGrabbed).flat()));
  }

  /** Makes the next draws read these textures. */
  bind() {
    this.positions.bind();
    this.fanRanges.bind();
    this.fans.bind();
    this.splits.bind();
    this.speeds.bind();
    this.flatPlaces?.bind();
  }

  delete() {
    for (const texture of [this.positions, this.fanRanges, this.fans, this.splits, this.speeds, this.flatPlaces]) texture?.delete();
    this.ghost?.delete();
    this.drawables.clear();
  }
}

/** The mark of a particle, by the precedence of the node: a grab before a pin, a pin before an anchor. @param {number} flags */
function markStyle(flags) {
  if (flags & PIN.frozen) return POINT.frozen;
  if (flags & PIN.grabbed) return POINT.grabbed;
  return flags & PIN.pinned ? POINT.pin : POINT.anchor;
}

/** The typical distance between a particle and the next one: the median in the order of their indices, in which the particles
 * of a row or of a pole follow each other. Infinity without two.
 * @param {ArrayLike<number>} positions @param {number[]} particles */
export function gapOf(positions, particles) {
  const ordered = [...particles].sort((a, b) => a - b);
  const gaps = ordered.slice(1).map((to, k) => Math.hypot(...[0, 1, 2].map((axis) => positions[3 * to + axis] - positions[3 * ordered[k] + axis])));
  return gaps.sort((a, b) => a - b)[gaps.length >> 1] ?? Infinity;
}

/** @param {Float32Array} lengths @param {number} fallback */
function medianLength(lengths, fallback) {
  if (lengths.length === 0) return fallback;
  // A sample is accurate enough for the width of a line.
  const sample = lengths.filter((_, index) => index % Math.ceil(lengths.length / 500) === 0).sort();
  return sample[sample.length >> 1];
}
