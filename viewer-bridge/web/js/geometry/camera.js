// One camera for both kinds of scene: it orbits a target in 3-D, and looks straight at the plane in
// 2-D. The orthographic height is derived from the distance and the same field of view, so zooming
// and framing share one formula.

import { add, addScaled, clamp, dot, length, multiply, normalize, scale, subtract, transform } from "./math.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** @typedef {import("./math.js").Mat4} Mat4 */
/** @typedef {{ right: Vec3, up: Vec3, toward: Vec3 }} Axes  axes of the camera at zero yaw and pitch, in world space */
/** @typedef {{ width: number, height: number }} Viewport  in CSS pixels */
/** Unit vectors of a picture: right, up, and from the target to the eye. @typedef {{ right: Vec3, up: Vec3, back: Vec3 }} Basis */
/** @typedef {{ origin: Vec3, direction: Vec3 }} Ray */

/** Vertical field of view, radians. */
const FIELD_OF_VIEW = (38 * Math.PI) / 180;
/** Just short of the pole, where yaw is undefined. */
const PITCH_MAX = Math.PI / 2 - 0.02;
/** Rotation in radians per CSS pixel of pointer motion. */
const TURN_PER_PIXEL = 0.008;
/** Depth range of a planar scene, relative to its width. */
const FLAT_DEPTH = 100;
/** Fraction of the picture that a framed box fills. */
const FRAME_FILL = 0.86;

/**
 * The axes of a scene. In 2-D, x always points right and z points at the viewer, so "-y" mirrors the
 * picture, as screen coordinates do. In 3-D nothing is mirrored.
 * @param {string} up "y", "-y" or "z" @param {number} dimensions
 * @returns {Axes}
 */
export function sceneAxes(up, dimensions) {
  if (up === "z") return { right: [1, 0, 0], up: [0, 0, 1], toward: [0, -1, 0] };
  if (up !== "-y") return { right: [1, 0, 0], up: [0, 1, 0], toward: [0, 0, 1] };
  return { right: [1, 0, 0], up: [0, -1, 0], toward: [0, 0, dimensions === 2 ? 1 : -1] };
}

export class Camera {
  constructor() {
    /** @type {Axes} */
    this.axes = sceneAxes("y", 3);
    this.isFlat = false;
    /** @type {Vec3} */
    this.target = [0, 0, 0];
    this.distance = 3;
    this.yaw = 0.5;
    this.pitch = 0.2;
    /** Radius of the scene: limits the distance and the clipping planes. */
    this.sceneRadius = 1;
    /** The last basis, and what it belongs to: a picture asks for it a dozen times. */
    this.known = { axes: this.axes, yaw: NaN, pitch: NaN, basis: /** @type {Basis | null} */ (null) };
  }

  /** Unit vectors of the picture: right, up, and from the target to the eye. Do not change them. @returns {Basis} */
  basis() {
    const yaw = this.isFlat ? 0 : this.yaw;
    const pitch = this.isFlat ? 0 : this.pitch;
    const { known, axes } = this;
    if (known.basis !== null && known.axes === axes && known.yaw === yaw && known.pitch === pitch) return known.basis;
    const basis = basisOf(axes, yaw, pitch);
    this.known = { axes, yaw, pitch, basis };
    return basis;
  }

  /** @returns {Vec3} */
  eye() {
    return addScaled(this.target, this.basis().back, this.distance);
  }

  /** Half the height of the picture at the target, in world units. */
  halfHeight() {
    return this.distance * Math.tan(FIELD_OF_VIEW / 2);
  }

  /** World units per CSS pixel at the depth of a point. @param {Vec3} point @param {Viewport} viewport */
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
      // The plane of the scene lies in the middle of the depth range: nothing is ever behind the eye.
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

  /** The intersection of the ray through a pixel with the camera-facing plane through `point`. A grab stays on this plane.
   * @param {number} x @param {number} y @param {Viewport} viewport @param {Vec3} point @returns {Vec3} */
  intersectFacingPlane(x, y, viewport, point) {
    const { origin, direction } = this.ray(x, y, viewport);
    const { back } = this.basis();
    const slope = dot(direction, back);
    const along = slope === 0 ? 0 : dot(subtract(point, origin), back) / slope;
    const hit = addScaled(origin, direction, along);
    if (this.isFlat) hit[2] = point[2];
    return hit;
  }

  /** The CSS pixel of a point, or null behind the eye. @param {Vec3} point @param {Viewport} viewport */
  project(point, viewport) {
    const [x, y, z, w] = transform(this.viewProjection(viewport), point);
    if (w <= 0) return null;
    return { x: ((x / w + 1) / 2) * viewport.width, y: ((1 - y / w) / 2) * viewport.height, depth: z / w };
  }

  /** Orbits the target; does nothing in 2-D. @param {number} dx @param {number} dy CSS pixels */
  orbit(dx, dy) {
    if (this.isFlat) return;
    this.yaw -= dx * TURN_PER_PIXEL;
    this.pitch = clamp(this.pitch + dy * TURN_PER_PIXEL, -PITCH_MAX, PITCH_MAX);
  }

  /** Moves the target along with the pointer. @param {number} dx @param {number} dy @param {Viewport} viewport */
  pan(dx, dy, viewport) {
    const { right, up } = this.basis();
    const unit = this.unitsPerPixel(this.target, viewport);
    this.target = addScaled(addScaled(this.target, right, -dx * unit), up, dy * unit);
  }

  /** Moves closer by `factor`, and keeps the point under the pixel in place. @param {number} factor @param {number} x @param {number} y @param {Viewport} viewport */
  zoom(factor, x, y, viewport) {
    const before = this.intersectFacingPlane(x, y, viewport, this.target);
    this.distance = clamp(this.distance / factor, this.sceneRadius * 0.02, this.sceneRadius * 60);
    const after = this.intersectFacingPlane(x, y, viewport, this.target);
    this.target = add(this.target, subtract(before, after));
  }

  /** Fits a box into the picture, seen from the current direction: the corner that needs the greatest
   * distance touches the margin. @param {import("./math.js").Box} box @param {number} aspect */
  frame(box, aspect) {
    const half = scale(subtract(box.max, box.min), 0.5);
    this.target = scale(add(box.min, box.max), 0.5);
    const radius = Math.max(length(half), 1e-6);
    this.sceneRadius = radius;
    const { right, up, back } = this.basis();
    const slope = Math.tan(FIELD_OF_VIEW / 2) * FRAME_FILL;
    this.distance = (radius * 0.2) / slope;
    for (let corner = 0; corner < 8; corner++) {
      const at = /** @type {Vec3} */ (half.map((size, axis) => ((corner >> axis) & 1 ? size : -size)));
      const closer = this.isFlat ? 0 : dot(at, back);
      this.distance = Math.max(this.distance, closer + Math.max(Math.abs(dot(at, up)), Math.abs(dot(at, right)) / aspect) / slope);
    }
  }
}

/** @param {Axes} axes @param {number} yaw @param {number} pitch @returns {Basis} */
function basisOf({ right, up, toward }, yaw, pitch) {
  const outward = add(scale(right, Math.sin(yaw)), scale(toward, Math.cos(yaw)));
  return {
    right: add(scale(right, Math.cos(yaw)), scale(toward, -Math.sin(yaw))),
    up: add(scale(up, Math.cos(pitch)), scale(outward, -Math.sin(pitch))),
    back: add(scale(outward, Math.cos(pitch)), scale(up, Math.sin(pitch))),
  };
}
