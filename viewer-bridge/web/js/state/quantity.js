// What the picture can be coloured by. A quantity of a constraint is linear in its length:
// value = (length - rest length) · |gain|. A gain of 0 means that the value is not known, and a negative one
// that the constraint pulls but never pushes.

import { CONSTRAINT } from "../net/wire.js";
import { valueOf } from "../net/messages.js";

/** @typedef {import("../net/wire.js").Scene} Scene */
/** @typedef {import("../net/messages.js").Values} Values */
/** @typedef {"strain" | "tension" | "speed" | "kind"} Quantity */

export const QUANTITIES = /** @type {const} */ (["strain", "tension", "speed", "kind"]);
/** Names of the kinds of constraints, by number. */
export const KINDS = ["structural", "shear", "bend", "tether"];

/** Gains of the strain: length / rest length - 1. A constraint without a rest length has none. @param {Scene} scene */
export function strainGains({ restLengths, constraintKinds }) {
  return Float32Array.from(restLengths, (length, i) => (length > 0 ? sign(constraintKinds[i]) / length : 0));
}

/**
 * Gains of the tension, which is (length - rest length) / compliance. That of a rigid constraint is not known:
 * it is the force that keeps the length, and no position shows it. The method pbd has no forces at all.
 * @param {Scene} scene @param {Values | null} values of the parameters @param {string | null} method
 */
export function tensionGains(scene, values, method) {
  const set = KINDS.map((kind) => valueOf(values, "compliance", kind));
  return Float32Array.from(scene.restLengths, (_, i) => {
    const compliance = complianceOf(scene, set, i);
    return method === "pbd" || !(compliance > 0) ? 0 : sign(scene.constraintKinds[i]) / compliance;
  });
}

/** The compliance of a constraint: what a command has set for its kind, or its own. @param {Scene} scene @param {(import("../net/messages.js").ParameterValue)[]} set by kind @param {number} constraint */
export function complianceOf({ compliances, constraintKinds }, set, constraint) {
  const ofKind = set[constraintKinds[constraint]];
  return typeof ofKind === "number" ? ofKind : compliances[constraint];
}

/** The value of a constraint. @param {number} length @param {number} restLength @param {number} gain */
export function valueAt(length, restLength, gain) {
  const value = (length - restLength) * Math.abs(gain);
  return gain < 0 ? Math.max(value, 0) : value;
}

/** @param {number} kind */
const sign = (kind) => (kind === CONSTRAINT.tether ? -1 : 1);
