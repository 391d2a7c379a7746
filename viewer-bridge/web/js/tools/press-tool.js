// A press that becomes a motion: the parts that grabbing a particle and carrying an object share.

import { clamp, scale, subtract } from "../geometry/math.js";
import { OVER_S } from "./tool.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").App} App */

/** Window over which the velocity of the pointer is measured, in ms. A pointer without motion for that long is at rest. */
const VELOCITY_MS = 80;
/** Least duration of a measured motion, in ms: about one frame. */
const VELOCITY_MS_MIN = 16;

/** Motion in CSS pixels, and time in ms, from which a press moves something. A shorter one is a click, which changes nothing. */
export const CLICK_PIXELS = 3;
export const CLICK_MS = 200;

/** Sends a target per animation frame with motion: where the pointer meets the camera-facing plane through a point. */
export class PressTool {
  /** @param {App} app @param {Pixel} start @param {Vec3} origin point of the plane @param {number | null} particle that was pressed */
  constructor(app, start, origin, particle) {
    this.app = app;
    this.start = start;
    this.origin = origin;
    this.particle = particle;
    this.pointer = start;
    this.isMoved = false;
    this.pressedMs = performance.now();
    this.sentMs = this.pressedMs;
    /** Recent positions of the pointer, from the start or from just before the velocity window. */
    this.trail = [{ ms: this.pressedMs, at: start }];
    /** The node has been asked for the motion. */
    this.isBegun = false;
    /** The node has refused it: another client moves the same. */
    this.isRefused = false;
  }

  /** Sets the time of the press, which a busy page sees later. @param {number} ms */
  setPressed(ms) {
    this.pressedMs = ms;
    this.trail[0].ms = ms;
  }

  begin() {
    if (this.isBegun) return;
    this.isBegun = true;
    this.request();
  }

  /** Asks the node for the motion. */
  request() {}

  /** Sends a target. @param {Vec3} _target @param {number} _over_s */
  send(_target, _over_s) {}

  /** Moves the plane. @param {Vec3} origin */
  setOrigin(origin) {
    this.origin = origin;
  }

  /** @param {Pixel} to @param {number} ms */
  move(to, ms) {
    this.pointer = to;
    this.isMoved = true;
    this.trail.push({ ms, at: to });
    while (this.trail.length > 1 && this.trail[1].ms < ms - VELOCITY_MS) this.trail.shift();
    if (Math.hypot(to.x - this.start.x, to.y - this.start.y) > CLICK_PIXELS) this.begin();
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    if (nowMs - this.pressedMs > CLICK_MS) this.begin();
    if (!this.isBegun) return;
    if (!this.isMoved) {
      // The next motion begins now. Spread over the rest before it, it would lag behind the pointer.
      this.sentMs = nowMs;
      return;
    }
    this.send(this.targetAt(this.pointer), clamp((nowMs - this.sentMs) / 1000, OVER_S.min, OVER_S.max));
    this.sentMs = nowMs;
    this.isMoved = false;
  }

  /** @param {Pixel} at @returns {Vec3} */
  targetAt(at) {
    const { camera, renderer } = this.app;
    return camera.intersectFacingPlane(at.x, at.y, renderer.viewport, this.origin);
  }

  /** Velocity of the pointer at a time, in scene units per second. @param {number} ms @returns {Vec3} */
  velocity(ms) {
    const last = this.trail[this.trail.length - 1];
    if (last.ms < ms - VELOCITY_MS) return [0, 0, 0];
    const begin = Math.max(this.trail[0].ms, last.ms - VELOCITY_MS);
    const span = Math.max(last.ms - begin, VELOCITY_MS_MIN);
    return scale(subtract(this.targetAt(last.at), this.targetAt(this.pointerAt(begin))), 1000 / span);
  }

  /** The position of the pointer between the first two of its trail. @param {number} ms @returns {Pixel} */
  pointerAt(ms) {
    const [first, next = first] = this.trail;
    const share = next.ms > first.ms ? clamp((ms - first.ms) / (next.ms - first.ms), 0, 1) : 0;
    return { x: first.at.x + (next.at.x - first.at.x) * share, y: first.at.y + (next.at.y - first.at.y) * share };
  }

  /** @returns {import("./tool.js").Trace} */
  describe() {
    return this.isBegun && this.particle !== null ? { line: { particle: this.particle, to: this.pointer } } : {};
  }
}
