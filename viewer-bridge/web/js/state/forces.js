// The forces of the frame as arrows, and the scale of their lengths.

import { addScaled, dot, length, scale, add, niceCeiling } from "../geometry/math.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("./simulation.js").Simulation} Simulation */
/** @typedef {import("../net/wire.js").Collider} Collider */
/** @typedef {{ kind: "collider" | "particle", index: number, from: Vec3, force: Vec3 }} Arrow  force in N */

/** Length of the longest arrow, in radii of the scene. */
const LONGEST_RADII = 0.5;
/** The scale changes when the greatest force falls below this part of it. */
const SHRINK_BELOW = 0.3;

/** The force on each collider and on each pinned, grabbed or anchored particle. An anchor has none of its own: its
 * row is the sum of those of its particles. @param {Simulation} simulation @returns {Arrow[]} */
export function arrowsOf(simulation) {
  const { forces } = simulation;
  if (forces === null) return [];
  /** @type {Arrow[]} */
  const arrows = [];
  for (const { kind, index, impulse } of forces.rows) {
    if (kind === "anchor" || length(impulse) === 0) continue;
    const from = kind === "particle" ? simulation.position(index) : middleOf(simulation.colliders.find((one) => one.index === index), simulation);
    if (from !== null) arrows.push({ kind, index, from, force: scale(impulse, forces.rateHz) });
  }
  return arrows;
}

/** The point of a collider at which its arrow begins. @param {Collider | undefined} one @param {Simulation} simulation @returns {Vec3 | null} */
function middleOf(one, simulation) {
  if (one === undefined) return null;
  if (one.shape === "capsule" || one.shape === "bounds") return scale(add(one.a, one.b), 0.5);
  if (one.shape !== "plane") return one.center;
  const { min, max } = simulation.box();
  const above = scale(add(min, max), 0.5);
  return addScaled(above, one.normal, one.offset - dot(one.normal, above));
}

/** The scale of arrows: a round number of newtons for the longest one. Hysteresis keeps it steady. */
export class ForceScale {
  constructor() {
    /** Force of the longest arrow in N; 0 before the first. */
    this.end = 0;
  }

  /** @param {Arrow[]} arrows */
  follow(arrows) {
    const greatest = arrows.reduce((most, { force }) => Math.max(most, length(force)), 0);
    if (greatest > this.end || (greatest > 0 && greatest < this.end * SHRINK_BELOW)) this.end = niceCeiling(greatest);
  }

  /** Length of an arrow per newton. @param {number} radius of the scene */
  unitsPerNewton(radius) {
    return this.end > 0 ? (radius * LONGEST_RADII) / this.end : 0;
  }
}
