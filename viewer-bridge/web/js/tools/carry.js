// Carrying: moves a collider or an anchor along with the pointer, and releases it with the velocity of the pointer.

import { hitBox, hitCapsule, hitMesh, hitPlane, hitSphere, hitTriangles } from "../geometry/hit.js";
import { addScaled, subtract } from "../geometry/math.js";
import { PIN } from "../net/wire.js";
import { PressTool } from "./press-tool.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").App} App */
/** @typedef {import("./tool.js").Tool} Tool */
/** A collider or an anchor, the point of it that was pressed, and the particle there.
 * @typedef {{ object: "collider" | "anchor", index: number, point: Vec3, particle: number | null }} Load */

/** @implements {Tool} */
export class CarryTool extends PressTool {
  /** @param {App} app @param {Pixel} start @param {Load} load */
  constructor(app, start, { object, index, point, particle }) {
    super(app, start, point, particle);
    this.carried = { object, index };
    /** The object is carried by the point under the pointer, so that it does not jump when the carrying begins. */
    this.from = this.targetAt(start);
  }

  request() {
    const { simulation, commands } = this.app;
    commands.run("lift", { epoch: simulation.scene?.epoch ?? 0, ...this.carried }, ({ status }) => { this.isRefused = status === "rejected"; });
  }

  /** @param {Vec3} target @param {number} over_s */
  send(target, over_s) {
    // It would be refused again in every frame.
    if (!this.isRefused) this.app.commands.stream("carry", { ...this.carried, offset: subtract(target, this.from), over_s });
  }

  /** @param {number} ms */
  end(ms) {
    this.release(this.velocity(ms));
  }

  /** Puts the object down: it only reaches its last target. */
  cancel() {
    this.release([0, 0, 0]);
  }

  /** @param {Vec3} velocity */
  release(velocity) {
    if (this.isBegun && !this.isRefused) this.app.commands.run("throw", { ...this.carried, velocity });
  }
}

/** @typedef {import("../geometry/camera.js").Ray} Ray */
/** @typedef {import("../net/wire.js").Collider} Collider */
/** @typedef {import("../net/wire.js").ColliderMesh} ColliderMesh */

/** Depth to which cloth that lies on a solid cuts into it and is still seen, relative to the distance from the eye. */
const CLOTH_DEPTH = 0.01;
/** Distance from which rays look at a 2-D scene, in radii of the scene. A camera that is near may lie in a solid. */
const FLAT_RADII = 1000;

/** The anchor that drives a particle. A pin comes before it. @param {import("../state/simulation.js").Simulation} simulation @param {number} particle */
export function anchorOf({ scene, pins }, particle) {
  const flags = pins.get(particle) ?? 0;
  if (scene === null || (flags & (PIN.anchored | PIN.pinned | PIN.grabbed)) !== PIN.anchored) return null;
  const anchor = scene.anchors.findIndex((particles) => particles.includes(particle));
  return anchor === -1 ? null : anchor;
}

/**
 * The solid that is seen at a pixel, and the point of it. Planes and bounds contain the scene, so they cannot be carried.
 * @param {App} app @param {import("../geometry/pick.js").Pixel} at @param {number} trianglesMax limit on the triangles of a mesh
 * @returns {{ index: number, point: Vec3 } | null}
 */
export function solidAt({ simulation, camera, renderer }, at, trianglesMax = Infinity) {
  const { scene, colliders } = simulation;
  if (scene === null) return null;
  const ray = camera.ray(at.x, at.y, renderer.viewport);
  if (camera.isFlat) ray.origin = addScaled(ray.origin, ray.direction, -FLAT_RADII * camera.sceneRadius);
  let index = -1;
  let nearest = Infinity;
  for (const one of colliders) {
    const mesh = scene.meshes.get(one.index);
    if (mesh !== undefined && mesh.triangles.length > 3 * trianglesMax) continue;
    const distance = distanceTo(one, mesh, ray);
    if (distance < nearest) [nearest, index] = [distance, one.index];
  }
  if (index === -1 || isHidden(simulation, renderer.toggles.surface, ray, camera.isFlat ? Infinity : nearest)) return null;
  return { index, point: addScaled(ray.origin, ray.direction, nearest) };
}

/** @param {Collider} one @param {ColliderMesh | undefined} mesh @param {Ray} ray */
function distanceTo(one, mesh, ray) {
  if (one.shape === "sphere") return hitSphere(ray, one.center, one.radius);
  if (one.shape === "box") return hitBox(ray, one.center, one.halfExtents, one.rotation);
  if (one.shape === "capsule") return hitCapsule(ray, one.a, one.b, one.radius);
  return one.shape === "mesh" && mesh !== undefined ? hitMesh(ray, one.center, one.rotation, mesh.vertices, mesh.triangles) : Infinity;
}

/** True if the cloth or the floor lies before a distance. @param {import("../state/simulation.js").Simulation} simulation @param {boolean} isSurfaceShown @param {Ray} ray @param {number} distance */
function isHidden({ scene, frame, topology, ground }, isSurfaceShown, ray, distance) {
  if (ground !== null && hitPlane(ray, ground.normal, ground.offset) < distance) return true;
  if (scene === null || frame === null || topology === null) return false;
  // A torn triangle is drawn in pieces.
  const isShown = (/** @type {number} */ triangle) => !topology.isDead[triangle] || topology.split.has(triangle);
  return isSurfaceShown && hitTriangles(ray, frame, scene.triangles, isShown) < distance * (1 + CLOTH_DEPTH);
}
