// What the particles of a scene stand for, as far as the scene says so: the planks of a bridge, ropes, limbs,
// and the pole of a flag.

import { addScaled, dot, length, subtract } from "../geometry/math.js";
import { CONSTRAINT, PIN } from "../net/wire.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../net/wire.js").Scene} Scene */
/** @typedef {import("../net/wire.js").Shape} Shape */
/** @typedef {import("./simulation.js").Simulation} Simulation */
/** A board between two particles, with the planks before and after it. `constraint` holds it together.
 * @typedef {{ left: number, right: number, before: number, after: number, constraint: number }} Plank */
/** @typedef {{ top: Vec3, foot: Vec3, radius: number }} Pole */

/** Constraints of a ragdoll by their order in its shape: the radius of the limb, as a fraction of the height. */
const LIMBS = [0.042, 0.022, 0.022, 0.026, 0.021, 0.026, 0.021, 0.05, 0.04, 0.04, 0.038, 0.029, 0.038, 0.029];
/** Its constraint from the neck to the pelvis, and the length of that as a fraction of the height. */
const SPINE = { index: 7, fraction: 0.32 };
/** Radius of a rope that touches nothing, in distances between its particles, and its limit in radii of the scene. */
const ROPE = { spacings: 0.4, radii: 0.02 };
/** Radius of the ropes of a bridge, in lengths of a plank. */
const BRIDGE_ROPE = 0.028;
/** Least number of pinned particles of a flag on a pole. */
const POLE_PINS_MIN = 3;
/** Grain of the places of such particles seen from above, in radii of the scene. */
const POLE_SLACK = 1e-3;
/** Height of a pole above its highest pin, radius, and drop below the lowest one where nothing else ends it, in lengths of the pinned part. */
const POLE = { above: 0.08, radius: 0.018, below: 1.2 };

/** @param {Shape} shape @param {number} particle */
const isWithin = ({ first, count }, particle) => particle >= first && particle < first + count;

/** The constraints between particles of a shape, in the order of the scene. @param {Scene} scene @param {Shape} shape */
function constraintsOf({ ends, constraintCount }, shape) {
  const own = [];
  for (let i = 0; i < constraintCount; i++) if (isWithin(shape, ends[2 * i]) && isWithin(shape, ends[2 * i + 1])) own.push(i);
  return own;
}

/** @param {Scene} scene @param {string} name */
const shapesNamed = (scene, name) => scene.shapes.filter((one) => one.shape === name);

/** The planks of all bridges. Plank i of a bridge joins its particles 2 i and 2 i + 1. @param {Scene} scene @returns {Plank[]} */
export function planksOf(scene) {
  return shapesNamed(scene, "bridge").flatMap((shape) => {
    const byLeft = new Map();
    for (const i of constraintsOf(scene, shape)) {
      const [left, right] = [Math.min(scene.ends[2 * i], scene.ends[2 * i + 1]), Math.max(scene.ends[2 * i], scene.ends[2 * i + 1])];
      if (right === left + 1 && (left - shape.first) % 2 === 0 && !byLeft.has(left)) byLeft.set(left, i);
    }
    const last = shape.first + shape.count - 2;
    return [...byLeft].map(([left, constraint]) => ({
      left, right: left + 1, before: Math.max(shape.first, left - 2), after: Math.min(last, left + 2), constraint,
    }));
  });
}

/** The ropes of all bridges: the structural constraints that are no planks. @param {Scene} scene */
export function bridgeRopes(scene) {
  const planks = new Set(planksOf(scene).map((one) => one.constraint));
  return shapesNamed(scene, "bridge").flatMap((shape) => constraintsOf(scene, shape).filter((i) => scene.constraintKinds[i] === CONSTRAINT.structural && !planks.has(i)));
}

/** True for each triangle of a bridge, in place of which planks can be drawn. @param {Scene} scene */
export function bridgeTriangles(scene) {
  const bridges = shapesNamed(scene, "bridge");
  const isBridge = new Uint8Array(scene.triangleCount);
  for (let t = 0; t < scene.triangleCount && bridges.length > 0; t++) isBridge[t] = bridges.some((one) => isWithin(one, scene.triangles[3 * t])) ? 1 : 0;
  return isBridge;
}

/**
 * The radius of each constraint as a solid body: of ropes by the distance that they keep from each other, of
 * limbs by the height of their figure. 0 for everything else, which is drawn as lines.
 * @param {Scene} scene @param {{ contact: number | null, sceneRadius: number }} known
 */
export function bodyRadii(scene, { contact, sceneRadius }) {
  const radii = new Float32Array(scene.constraintCount);
  for (const shape of shapesNamed(scene, "rope")) {
    for (const i of constraintsOf(scene, shape)) radii[i] = contact !== null ? contact / 2 : Math.min(scene.restLengths[i] * ROPE.spacings, sceneRadius * ROPE.radii);
  }
  for (const shape of shapesNamed(scene, "ragdoll")) {
    const own = constraintsOf(scene, shape);
    const height = scene.restLengths[own[SPINE.index]] / SPINE.fraction || 0;
    own.forEach((i, k) => { radii[i] = (LIMBS[k] ?? 0) * height; });
  }
  const planks = new Map(planksOf(scene).map((one) => [one.left, scene.restLengths[one.constraint]]));
  for (const i of bridgeRopes(scene)) {
    const end = Math.min(scene.ends[2 * i], scene.ends[2 * i + 1]);
    radii[i] = BRIDGE_ROPE * (planks.get(end) ?? planks.get(end - 1) ?? 0);
  }
  return radii;
}

/**
 * The poles of flags: vertical lines of pinned particles of a sheet. A pole ends on the ground, or as low as the
 * scene can hang.
 * @param {Simulation} simulation @returns {Pole[]}
 */
export function polesOf(simulation) {
  const { scene, ground, lowest } = simulation;
  if (scene === null || scene.isPlanar) return [];
  const { up } = simulation.axes();
  return pinnedLines(simulation, up).map(({ high, low }) => {
    const size = dot(subtract(high, low), up);
    const floor = ground?.offset ?? lowest ?? -Infinity;
    const foot = Math.max(Math.min(floor, dot(low, up) - POLE.above * size), dot(low, up) - POLE.below * size);
    return { top: addScaled(high, up, POLE.above * size), foot: addScaled(low, up, foot - dot(low, up)), radius: POLE.radius * size };
  });
}

/** The vertical lines of pinned particles. @param {Simulation} simulation @param {Vec3} up */
function pinnedLines(simulation, up) {
  const { topology, pins, frame } = simulation;
  if (topology === null || frame === null) return [];
  const slack = POLE_SLACK * simulation.radius();
  /** By the place seen from above. @type {Map<string, Vec3[]>} */
  const lines = new Map();
  for (const [particle, flags] of pins) {
    const at = simulation.position(particle);
    if (at === null || (flags & PIN.pinned) === 0 || topology.fanRanges[2 * particle + 1] === 0) continue;
    const place = addScaled(at, up, -dot(at, up)).map((axis) => Math.round(axis / slack)).join();
    const line = lines.get(place);
    if (line === undefined) lines.set(place, [at]);
    else line.push(at);
  }
  return [...lines.values()].filter((line) => line.length >= POLE_PINS_MIN).map((line) => {
    const sorted = line.sort((a, b) => dot(subtract(a, b), up));
    return { low: sorted[0], high: sorted[sorted.length - 1] };
  }).filter(({ high, low }) => length(subtract(high, low)) > slack);
}
