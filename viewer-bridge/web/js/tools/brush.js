// The brush: pushes all particles within a circle along with the pointer.

import { clamp, subtract } from "../geometry/math.js";
import { OVER_S, depthUnder, newStroke } from "./tool.js";

/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").App} App */
/** @typedef {import("./tool.js").Tool} Tool */

/** Limit on the push in CSS pixels per sixtieth of a second. */
const PUSH_PIXELS_MAX = 20;
/** Least duration of a push, in seconds. */
const OVER_S_MIN = 0.001;

/** @implements {Tool} */
export class BrushTool {
  /** @param {App} app @param {Pixel} start @param {number} radius CSS pixels */
  constructor(app, start, radius) {
    this.app = app;
    this.start = start;
    this.before = start;
    this.pointer = start;
    this.radius = radius;
    this.sentMs = performance.now();
    this.number = newStroke();
    this.depth = depthUnder(app, start, radius) ?? app.camera.target;
  }

  /** @param {Pixel} to */
  move(to) {
    this.pointer = to;
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    const { camera, renderer, commands } = this.app;
    const { viewport } = renderer;
    if (this.pointer.x === this.before.x && this.pointer.y === this.before.y) {
      this.sentMs = nowMs;
      return;
    }
    const on = (/** @type {Pixel} */ at) => camera.intersectFacingPlane(at.x, at.y, viewport, this.depth);
    const over_s = clamp((nowMs - this.sentMs) / 1000, OVER_S_MIN, OVER_S.max);
    const unit = camera.unitsPerPixel(this.depth, viewport);
    const { origin, direction } = camera.ray(this.before.x, this.before.y, viewport);
    commands.stream("brush", {
      eye: origin, ray: direction, radius: this.radius * unit, over_s,
      delta: subtract(on(this.pointer), on(this.before)), cap: PUSH_PIXELS_MAX * unit * 60 * over_s, stroke: this.number,
    });
    this.before = this.pointer;
    this.sentMs = nowMs;
  }

  end() {}

  cancel() {}

  describe() {
    return { circle: { at: this.pointer, radius: this.radius } };
  }
}
