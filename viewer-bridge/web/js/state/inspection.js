// What is known of a particle or a constraint. Values are exact where the bridge has sent them for this frame.

import { length, scale, subtract } from "../geometry/math.js";
import { PIN, CONSTRAINT } from "../net/wire.js";
import { valueOf } from "../net/messages.js";
import { KINDS, complianceOf } from "./quantity.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("./simulation.js").Simulation} Simulation */
/** @typedef {{ position: Vec3, velocity: Vec3 | null, speed: number, inverseMass: number | null, flags: number, force: Vec3 | null }} ParticleValues */
/** Lengths of a constraint; `tension` is null where it is not known.
 * @typedef {{ ends: [number, number], kind: string, length: number, restLength: number, strain: number, compliance: number | null, tension: number | null, cause: string | null, isRigid: boolean }} ConstraintValues */

/** Why a constraint is torn, by the number of the cause. */
const CAUSES = ["its force exceeded the tear force", "it was longer than the tear stretch allows", "it was longer than the tear distance allows", "it was cut"];

/** @param {Simulation} simulation @param {number} particle @returns {ParticleValues | null} */
export function inspectParticle(simulation, particle) {
  const row = rowOf(simulation, particle);
  const position = row?.position ?? simulation.position(particle);
  if (position === null) return null;
  return {
    position, velocity: row?.velocity ?? null, speed: row === undefined ? NaN : length(row.velocity),
    inverseMass: row?.inverseMass ?? null, flags: simulation.pins.get(particle) ?? 0, force: forceOn(simulation, particle),
  };
}

/** @param {Simulation} simulation @param {number} constraint @returns {ConstraintValues | null} */
export function inspectConstraint(simulation, constraint) {
  const { scene, parameters, node } = simulation;
  if (scene === null || constraint >= scene.constraintCount) return null;
  const ends = /** @type {[number, number]} */ ([scene.ends[2 * constraint], scene.ends[2 * constraint + 1]]);
  const apart = distanceOf(simulation, ends[0], ends[1]);
  if (apart === null) return null;
  const restLength = scene.restLengths[constraint];
  const isPbd = node?.method === "pbd";
  const set = KINDS.map((kind) => valueOf(parameters?.values ?? null, "compliance", kind));
  const compliance = isPbd ? null : complianceOf(scene, set, constraint);
  const isSlack = scene.constraintKinds[constraint] === CONSTRAINT.tether && apart < restLength;
  const stretch = isSlack ? 0 : apart - restLength;
  const place = simulation.torn.indexOf(constraint);
  const cause = place === -1 ? null : CAUSES[simulation.tornCauses[place]] ?? "the cause is not known";
  return {
    ends, kind: KINDS[scene.constraintKinds[constraint]] ?? "unknown", length: apart, restLength,
    strain: restLength > 0 ? stretch / restLength : NaN, compliance, isRigid: compliance === 0, cause,
    tension: cause === null && compliance !== null && compliance > 0 ? stretch / compliance : null,
  };
}

/** Distance of two particles. @param {Simulation} simulation @param {number} a @param {number} b */
export function distanceOf(simulation, a, b) {
  const [from, to] = [a, b].map((one) => rowOf(simulation, one)?.position ?? simulation.position(one));
  return from === null || to === null ? null : length(subtract(to, from));
}

/** Names the holders of a particle. @param {number} flags @param {boolean} isOurs this page grabs it */
export function holderOf(flags, isOurs) {
  const holders = [];
  if (flags & PIN.frozen) holders.push("frozen: its state was not finite");
  if (flags & PIN.grabbed) holders.push(isOurs ? "grabbed by this page" : "grabbed by another client");
  if (flags & PIN.pinned) holders.push("pinned");
  if (flags & PIN.anchored) holders.push("anchored");
  return holders.length === 0 ? "nothing: it is free" : holders.join(", ");
}

/** The force of its constraints on a held particle, where the node has published it. @param {Simulation} simulation @param {number} particle @returns {Vec3 | null} */
function forceOn({ forces }, particle) {
  const row = forces?.rows.find((one) => one.kind === "particle" && one.index === particle);
  return forces === null || row === undefined ? null : scale(row.impulse, forces.rateHz);
}

/** @param {Simulation} simulation @param {number} particle */
const rowOf = ({ inspected }, particle) => inspected?.rows.find((one) => one.particle === particle);

/** @param {Simulation} simulation @param {import("./selection.js").Item} item */
export const inspectItem = (simulation, { kind, index }) => (kind === "particle" ? inspectParticle(simulation, index) : inspectConstraint(simulation, index));
