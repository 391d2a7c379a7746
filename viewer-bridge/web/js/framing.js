// The box that a first look at a scene should show: what is there, and where it is going to be.

import { add, addScaled, dot, length, scale, subtract } from "./math.js";
import { PIN } from "./wire.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** @typedef {import("./math.js").Box} Box */
/** @typedef {import("./wire.js").Collider} Collider */

/** Half of the box round a scene that is a single point, in the scene's unit. */
const POINT_ROOM = 0.5;
/** A floor or a solid is shown with what is at most so many times its own size away from it. */
const FLOOR_SIZES = 3;
const SOLID_SIZES = 1;
/** Part of its size that what anchors carry is given on each side, to move in. */
const CARRIED_ROOM = 0.2;

/** @param {import("./state.js").Simulation} simulation @returns {Box} */
export function stageOf(simulation) {
  const bounds = simulation.colliders.find((one) => one.shape === "bounds");
  if (bounds) return { min: bounds.a, max: bounds.b };
  const { up } = simulation.axes();
  const box = simulation.box();
  if (length(subtract(box.max, box.min)) === 0) grow(box, POINT_ROOM);
  const size = length(subtract(box.max, box.min));
  const middle = scale(add(box.min, box.max), 0.5);
  const floor = simulation.ground ?? simulation.floor();
  if (floor !== null) {
    const drop = dot(floor.normal, middle) - floor.offset;
    if (drop > 0 && drop < FLOOR_SIZES * size) include(box, addScaled(middle, up, -drop));
  }
  if (simulation.pins.size === 1) {
    const pivot = simulation.position([...simulation.pins.keys()][0]);
    if (pivot !== null) for (const axis of [0, 1, 2]) if (up[axis] === 0) mirror(box, pivot, axis);
  }
  if ([...simulation.pins.values()].some((flags) => (flags & PIN.anchored) !== 0)) grow(box, CARRIED_ROOM * size);
  for (const one of simulation.colliders) includeSolid(box, one, middle, size);
  return box;
}

/** A solid that is near enough, and not so big that nothing else would be seen. @param {Box} box @param {Collider} one @param {Vec3} middle @param {number} size */
function includeSolid(box, one, middle, size) {
  const [center, reach] = ballRound(one);
  if (reach > size || length(subtract(center, middle)) > SOLID_SIZES * size + reach) return;
  for (const axis of [0, 1, 2]) {
    box.min[axis] = Math.min(box.min[axis], center[axis] - reach);
    box.max[axis] = Math.max(box.max[axis], center[axis] + reach);
  }
}

/** Middle and radius of a ball round a solid; that of a plane has no end. @param {Collider} one @returns {[Vec3, number]} */
function ballRound(one) {
  if (one.shape === "sphere") return [one.center, one.radius];
  if (one.shape === "box") return [one.center, length(one.halfExtents)];
  if (one.shape === "capsule") return [scale(add(one.a, one.b), 0.5), length(subtract(one.b, one.a)) / 2 + one.radius];
  return [[0, 0, 0], Infinity];
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

/** Makes a box reach as far on one side of a pivot as on the other. @param {Box} box @param {Vec3} pivot @param {number} axis */
function mirror(box, pivot, axis) {
  const reach = Math.max(box.max[axis] - pivot[axis], pivot[axis] - box.min[axis]);
  if (reach < 1e-6) return;
  box.min[axis] = pivot[axis] - reach;
  box.max[axis] = pivot[axis] + reach;
}
