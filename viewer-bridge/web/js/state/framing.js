// The boxes that views of a scene show: the first one with the space that the scene will move into, a fitted one
// without.

import { add, addScaled, boxOf, dot, length, rotate, scale, subtract } from "../geometry/math.js";
import { PIN } from "../net/wire.js";
import { polesOf } from "./shapes.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/math.js").Box} Box */
/** @typedef {import("../net/wire.js").Collider} Collider */
/** @typedef {import("../net/wire.js").ColliderMesh} ColliderMesh */

/** Half the size of the box around a scene that is a single point, in the unit of the scene. */
const POINT_ROOM = 0.5;
/** Greatest distance of a floor and of a solid that are still framed, in sizes of the scene. */
const FLOOR_SIZES = 3;
const SOLID_SIZES = 1;
/** Greatest distance of a particle of a ghost that is still framed, in sizes of the scene: parts that fell away are not. */
const GHOST_SIZES = 2;
/** Margin on each side of a scene that anchors move, and of a flag in the wind, as fractions of its size. */
const CARRIED_ROOM = 0.2;
const FLYING_ROOM = 0.04;

/** @param {import("./simulation.js").Simulation} simulation @returns {Box} */
export function firstViewBox(simulation) {
  const bounds = simulation.colliders.find((one) => one.shape === "bounds");
  if (bounds) return { min: bounds.a, max: bounds.b };
  const { up } = simulation.axes();
  const box = roomyBox(simulation);
  const size = length(subtract(box.max, box.min));
  const middle = scale(add(box.min, box.max), 0.5);
  const isFlying = isFlag(simulation);
  if (isFlying) grow(box, FLYING_ROOM * size);
  // A flag does not hang while the wind blows.
  const hangs = simulation.lowest === null || isFlying ? null : { normal: up, offset: simulation.lowest };
  const floor = simulation.ground ?? simulation.floor() ?? hangs;
  if (floor !== null) {
    const drop = dot(floor.normal, middle) - floor.offset;
    if (drop > 0 && drop < FLOOR_SIZES * size) include(box, addScaled(middle, up, -drop));
  }
  if (simulation.pins.size === 1) {
    const pivot = simulation.position([...simulation.pins.keys()][0]);
    if (pivot !== null) for (const axis of [0, 1, 2]) if (up[axis] === 0) mirror(box, pivot, axis);
  }
  if ([...simulation.pins.values()].some((flags) => (flags & PIN.anchored) !== 0)) grow(box, CARRIED_ROOM * size);
  includeSolids(box, simulation);
  return box;
}

/** The box of the scene as it is now, with the ghost and the solids beside it. @param {import("./simulation.js").Simulation} simulation @returns {Box} */
export function fittedBox(simulation) {
  const bounds = simulation.colliders.find((one) => one.shape === "bounds");
  if (bounds) return { min: bounds.a, max: bounds.b };
  const box = roomyBox(simulation);
  includeGhost(box, simulation.ghost);
  includeSolids(box, simulation);
  return box;
}

/** Includes the particles of a ghost that are not far away. @param {Box} box @param {import("../net/wire.js").Ghost | null} ghost */
function includeGhost(box, ghost) {
  const far = GHOST_SIZES * length(subtract(box.max, box.min));
  const middle = scale(add(box.min, box.max), 0.5);
  const positions = ghost?.positions ?? [];
  for (let at = 0; at < positions.length; at += 3) {
    const position = /** @type {Vec3} */ ([positions[at], positions[at + 1], positions[at + 2]]);
    if (length(subtract(position, middle)) < far) include(box, position);
  }
}

/** The box of the particles that belong to the scene, with room around a single point. @param {import("./simulation.js").Simulation} simulation */
function roomyBox(simulation) {
  const box = heldBox(simulation);
  if (length(subtract(box.max, box.min)) === 0) grow(box, POINT_ROOM);
  return box;
}

/** True for cloth on a pole in a scene with wind. @param {import("./simulation.js").Simulation} simulation */
function isFlag(simulation) {
  const wind = simulation.parameters?.initial?.["wind.velocity"];
  return Array.isArray(wind) && wind.some((axis) => axis !== 0) && polesOf(simulation).length > 0;
}

/** Includes the solids that are close to a box, and no bigger than it. @param {Box} box @param {import("./simulation.js").Simulation} simulation */
export function includeSolids(box, simulation) {
  const size = length(subtract(box.max, box.min));
  const middle = scale(add(box.min, box.max), 0.5);
  for (const one of simulation.colliders) includeSolid(box, boundingSphere(one, simulation.scene?.meshes.get(one.index)), middle, size);
}

/** The box of the particles that still belong to the scene: those that something holds, or the largest part
 * if nothing is held. Parts that were cut off and have fallen away are no part of the picture.
 * @param {import("./simulation.js").Simulation} simulation @returns {Box} */
export function heldBox(simulation) {
  const { scene, topology, torn, pins } = simulation;
  if (scene === null || topology === null || torn.length === 0) return simulation.box();
  const parts = partsOf(scene, topology.isGone);
  const held = new Set([...pins.keys()].map((particle) => parts[particle]));
  if (held.size === 0) held.add(largestOf(parts));
  /** @type {number[]} */
  const positions = [];
  for (let p = 0; p < scene.particleCount; p++) {
    const at = held.has(parts[p]) ? simulation.position(p) : null;
    if (at !== null && at.every(Number.isFinite)) positions.push(...at);
  }
  return positions.length === 0 ? simulation.box() : boxOf(positions);
}

/** True if nothing holds some part of the scene. @param {import("./simulation.js").Simulation} simulation */
export function hasFreePart({ scene, topology, pins }) {
  if (scene === null || topology === null) return false;
  if (pins.size === 0) return true;
  const parts = partsOf(scene, topology.isGone);
  const held = new Set([...pins.keys()].map((particle) => parts[particle]));
  return parts.some((part) => !held.has(part));
}

/** For each particle, a particle that stands for all that intact constraints connect with it. @param {import("../net/wire.js").Scene} scene @param {Uint8Array} isGone */
function partsOf({ particleCount, ends }, isGone) {
  const parts = Uint32Array.from({ length: particleCount }, (_, p) => p);
  const root = (/** @type {number} */ p) => {
    while (parts[p] !== p) p = parts[p] = parts[parts[p]];
    return p;
  };
  for (let i = 0; i < isGone.length; i++) if (!isGone[i]) parts[root(ends[2 * i])] = root(ends[2 * i + 1]);
  return parts.map((_, p) => root(p));
}

/** @param {Uint32Array} parts */
function largestOf(parts) {
  const counts = new Map();
  for (const part of parts) counts.set(part, (counts.get(part) ?? 0) + 1);
  return [...counts].reduce((best, one) => (one[1] > best[1] ? one : best))[0];
}

/** Includes a solid that is close enough, and no bigger than the scene. @param {Box} box @param {[Vec3, number]} sphere @param {Vec3} middle @param {number} size */
function includeSolid(box, [center, reach], middle, size) {
  if (reach > size || length(subtract(center, middle)) > SOLID_SIZES * size + reach) return;
  for (const axis of [0, 1, 2]) {
    box.min[axis] = Math.min(box.min[axis], center[axis] - reach);
    box.max[axis] = Math.max(box.max[axis], center[axis] + reach);
  }
}

/** Center and radius of a bounding sphere of a solid; infinite for a plane. @param {Collider} one @param {ColliderMesh | undefined} mesh @returns {[Vec3, number]} */
function boundingSphere(one, mesh) {
  if (one.shape === "mesh" && mesh) {
    const { center, reach } = sphereOf(mesh);
    return [add(one.center, rotate(one.rotation, center)), reach];
  }
  if (one.shape === "sphere") return [one.center, one.radius];
  if (one.shape === "box") return [one.center, length(one.halfExtents)];
  if (one.shape === "capsule") return [scale(add(one.a, one.b), 0.5), length(subtract(one.b, one.a)) / 2 + one.radius];
  return [[0, 0, 0], Infinity];
}

/** The sphere around the middle of the box of a mesh, in its own coordinates. @param {ColliderMesh} mesh */
function sphereOf({ vertices }) {
  const { min, max } = boxOf(vertices);
  const center = scale(add(min, max), 0.5);
  let square = 0;
  for (let at = 0; at < vertices.length; at += 3) {
    square = Math.max(square, (vertices[at] - center[0]) ** 2 + (vertices[at + 1] - center[1]) ** 2 + (vertices[at + 2] - center[2]) ** 2);
  }
  return { center, reach: Math.sqrt(square) };
}

/** @param {Box} box @param {number} room */
function grow(box, room) {
  for (const axis of [0, 1, 2]) {
    box.min[axis] -= room;
    box.max[axis] += room;
  }
}

/** @param {Box} box @param {Vec3} point */
function include(box, point) {
  for (const axis of [0, 1, 2]) {
    box.min[axis] = Math.min(box.min[axis], point[axis]);
    box.max[axis] = Math.max(box.max[axis], point[axis]);
  }
}

/** Makes a box symmetric about a pivot along one axis. @param {Box} box @param {Vec3} pivot @param {number} axis */
function mirror(box, pivot, axis) {
  const reach = Math.max(box.max[axis] - pivot[axis], pivot[axis] - box.min[axis]);
  if (reach < 1e-6) return;
  box.min[axis] = pivot[axis] - reach;
  box.max[axis] = pivot[axis] + reach;
}
