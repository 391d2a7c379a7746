// One camera for both views: it turns about a target in three dimensions, and looks straight at the
// plane in two. The orthographic height follows the distance by the same angle, so that zooming and
// framing are one formula.

import { add, addScaled, clamp, dot, length, multiply, normalize, scale, subtract, transform } from "./math.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** @typedef {import("./math.js").Mat4} Mat4 */
/** @typedef {{ right: Vec3, up: Vec3, toward: Vec3 }} Axes  of the unturned camera, in the world */
/** @typedef {{ width: number, height: number }} Viewport  CSS pixels */
/** @typedef {{ origin: Vec3, direction: Vec3 }} Ray */

/** Vertical field of view, radians. */
const FIELD_OF_VIEW = (38 * Math.PI) / 180;
/** Just short of the pole, where yaw would lose its meaning. */
const PITCH_MAX = Math.PI / 2 - 0.02;
/** Radians that a drag across 1 CSS pixel turns. */
const TURN_PER_PIXEL = 0.008;
/** How much deeper than wide the room of a plane scene is. */
const FLAT_DEPTH = 100;
/** Share of the picture that a framed box fills. */
const FRAME_FILL = 0.8;

/**
 * The axes of a scene. In two dimensions x goes right and z towards the viewer whatever is up, so
 * that "-y" mirrors the picture as a screen does; in three nothing is mirrored.
 * @param {string} up "y", "-y" or "z" @param {number} dimensions
 * @returns {Axes}
 */
export function axesOf(up, dimensions) {
  if (up === "z") return { right: [1, 0, 0], up: [0, 0, 1], toward: [0, -1, 0] };
  if (up !== "-y") return { right: [1, 0, 0], up: [0, 1, 0], toward: [0, 0, 1] };
  return { right: [1, 0, 0], up: [0, -1, 0], toward: [0, 0, dimensions === 2 ? 1 : -1] };
}

export class Camera {
  constructor() {
    /** @type {Axes} */
    this.axes = axesOf("y", 3);
    this.isFlat = false;
    /** @type {Vec3} */
    this.target = [0, 0, 0];
    this.distance = 3;
    this.yaw = 0.5;
    this.pitch = 0.2;
    /** Radius of the scene: bounds the distance and the clipping planes. */
    this.sceneRadius = 1;
    /** Counts the changes, so that a picture knows whether it is the newest. */
    this.revision = 0;
  }

  /** Unit vectors of the picture: right, up, and from the target to the eye. */
  basis() {
    const { right, up, toward } = this.axes;
    const yaw = this.isFlat ? 0 : this.yaw;
    const pitch = this.isFlat ? 0 : this.pitch;
    const outward = add(scale(right, Math.sin(yaw)), scale(toward, Math.cos(yaw)));
    return {
      right: add(scale(right, Math.cos(yaw)), scale(toward, -Math.sin(yaw))),
      up: add(scale(up, Math.cos(pitch)), scale(outward, -Math.sin(pitch))),
      back: add(scale(outward, Math.cos(pitch)), scale(up, Math.sin(pitch))),
    };
  }

  /** @returns {Vec3} */
  eye() {
    return addScaled(this.target, this.basis().back, this.distance);
  }

  /** Half of the height of the picture, in the world, at the target. */
  halfHeight() {
    return this.distance * Math.tan(FIELD_OF_VIEW / 2);
  }

  /** World units under one CSS pixel, at a point's depth. @param {Vec3} point @param {Viewport} viewport */
  unitsPerPixel(point, viewport) {
    const depth = this.isFlat ? this.distance : dot(subtract(this.eye(), point), this.basis().back);
    return (2 * Math.max(depth, 0) * Math.tan(FIELD_OF_VIEW / 2)) / viewport.height;
  }

  /** @returns {Mat4} */
  view() {
    const { right: r, up: u, back: b } = this.basis();
    const e = this.eye();
    return [r[0], u[0], b[0], 0, r[1], u[1], b[1], 0, r[2], u[2], b[2], 0, -dot(r, e), -dot(u, e), -dot(b, e), 1];
  }

  /** @param {number} aspect width / height @returns {Mat4} */
  projection(aspect) {
    const reach = this.distance + this.sceneRadius * 4;
    if (this.isFlat) {
      const h = this.halfHeight();
      // The plane of the scene is in the middle of the depths: nothing is ever behind the eye.
      const depth = reach * FLAT_DEPTH;
      return [1 / (h * aspect), 0, 0, 0, 0, 1 / h, 0, 0, 0, 0, -1 / depth, 0, 0, 0, -this.distance / depth, 1];
    }
    const near = Math.max(this.distance * 0.02, this.sceneRadius * 1e-3);
    const far = reach * 8;
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
  }

  /** @param {Viewport} viewport @returns {Mat4} */
  viewProjection(viewport) {
    return multiply(this.projection(viewport.width / viewport.height), this.view());
  }

  /** The ray through a CSS pixel. @param {number} x @param {number} y @param {Viewport} viewport @returns {Ray} */
  ray(x, y, viewport) {
    const { right, up, back } = this.basis();
    const h = this.halfHeight();
    const across = ((2 * x) / viewport.width - 1) * h * (viewport.width / viewport.height);
    const upward = (1 - (2 * y) / viewport.height) * h;
    const onTarget = addScaled(addScaled(this.target, right, across), up, upward);
    if (this.isFlat) return { origin: addScaled(onTarget, back, this.distance), direction: scale(back, -1) };
    const origin = this.eye();
    return { origin, direction: normalize(subtract(onTarget, origin)) };
  }

  /** Where a ray through a pixel meets the plane through `point` that faces the camera: a drag stays there.
   * @param {number} x @param {number} y @param {Viewport} viewport @param {Vec3} point @returns {Vec3} */
  onPlaneThrough(x, y, viewport, point) {
    const { origin, direction } = this.ray(x, y, viewport);
    const { back } = this.basis();
    const slope = dot(direction, back);
    const along = slope === 0 ? 0 : dot(subtract(point, origin), back) / slope;
    const hit = addScaled(origin, direction, along);
    if (this.isFlat) hit[2] = point[2];
    return hit;
  }

  /** CSS pixels of a point, or null behind the eye. @param {Vec3} point @param {Viewport} viewport */
  project(point, viewport) {
    const [x, y, z, w] = transform(this.viewProjection(viewport), point);
    if (w <= 0) return null;
    return { x: ((x / w + 1) / 2) * viewport.width, y: ((1 - y / w) / 2) * viewport.height, depth: z / w };
  }

  /** Turns about the target; in two dimensions there is nothing to turn. @param {number} dx @param {number} dy CSS pixels */
  orbit(dx, dy) {
    if (this.isFlat) return;
    this.yaw -= dx * TURN_PER_PIXEL;
    this.pitch = clamp(this.pitch + dy * TURN_PER_PIXEL, -PITCH_MAX, PITCH_MAX);
    this.revision++;
  }

  /** Moves the target so that it stays under the pointer. @param {number} dx @param {number} dy @param {Viewport} viewport */
  pan(dx, dy, viewport) {
    const { right, up } = this.basis();
    const unit = this.unitsPerPixel(this.target, viewport);
    this.target = addScaled(addScaled(this.target, right, -dx * unit), up, dy * unit);
    this.revision++;
  }

  /** Comes nearer by `factor`, keeping what is under the pixel where it is. @param {number} factor @param {number} x @param {number} y @param {Viewport} viewport */
  zoom(factor, x, y, viewport) {
    const before = this.onPlaneThrough(x, y, viewport, this.target);
    this.distance = clamp(this.distance / factor, this.sceneRadius * 0.02, this.sceneRadius * 60);
    const after = this.onPlaneThrough(x, y, viewport, this.target);
    this.target = add(this.target, subtract(before, after));
    this.revision++;
  }

  /** Shows a whole box, from the direction that the camera has. @param {import("./math.js").Box} box @param {number} aspect */
  frame(box, aspect) {
    const half = scale(subtract(box.max, box.min), 0.5);
    this.target = scale(add(box.min, box.max), 0.5);
    const radius = Math.max(length(half), 1e-6);
    this.sceneRadius = radius;
    const { right, up } = this.basis();
    const extent = (/** @type {Vec3} */ axis) => Math.abs(axis[0]) * half[0] + Math.abs(axis[1]) * half[1] + Math.abs(axis[2]) * half[2];
    const needed = Math.max(extent(up), extent(right) / aspect, radius * 0.2) / FRAME_FILL;
    const depth = this.isFlat ? 0 : extent(this.basis().back);
    this.distance = needed / Math.tan(FIELD_OF_VIEW / 2) + depth;
    this.revision++;
  }
}
