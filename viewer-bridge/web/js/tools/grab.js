// The grab: drives one particle to the pointer, and releases it with the velocity of the pointer.

import { addScaled, clamp, length, scale, subtract } from "../geometry/math.js";
import { OVER_S } from "./tool.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").App} App */
/** @typedef {import("./tool.js").Tool} Tool */

/** Window over which the velocity of the pointer is measured, in ms. A pointer without motion for that long is at rest. */
const VELOCITY_MS = 80;
/** Least duration of a measured motion, in ms: about one frame. */
const VELOCITY_MS_MIN = 16;

/** Motion in CSS pixels, and time in ms, from which a press grabs. A shorter one is a click, which changes nothing. */
export const CLICK_PIXELS = 3;
const CLICK_MS = 200;

/** Grabs a particle. Its target is where the pointer meets the camera-facing plane through it. @implements {Tool} */
export class GrabTool {
  /** @param {App} app @param {number} particle @param {Pixel} start */
  constructor(app, particle, start) {
    this.app = app;
    this.particle = particle;
    this.start = start;
    this.pointer = start;
    this.isMoved = false;
    this.sentMs = performance.now();
    /** Recent positions of the pointer, from the start or from just before the velocity window. */
    this.pressedMs = this.sentMs;
    this.trail = [{ ms: this.sentMs, at: start }];
    this.origin = /** @type {Vec3} */ (app.simulation.position(particle));
    /** The node has been asked for the grab. */
    this.isBegun = false;
    /** The node has refused it: another client grabs the particle. */
    this.isRefused = false;
  }

  begin() {
    if (this.isBegun) return;
    this.isBegun = true;
    this.origin = this.app.simulation.position(this.particle) ?? this.origin;
    this.app.commands.run("grab", { particle: this.particle, target: this.origin }, ({ status }) => { this.isRefused = status !== "applied"; });
  }

  /** @param {Pixel} to */
  move(to) {
    this.pointer = to;
    this.isMoved = true;
    const ms = performance.now();
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
    const over_s = clamp((nowMs - this.sentMs) / 1000, OVER_S.min, OVER_S.max);
    this.app.commands.stream("move", { particle: this.particle, target: this.targetAt(this.pointer), over_s });
    this.sentMs = nowMs;
    this.isMoved = false;
  }

  /** @param {Pixel} at @returns {Vec3} */
  targetAt(at) {
    const { camera, renderer } = this.app;
    return camera.intersectFacingPlane(at.x, at.y, renderer.viewport, this.origin);
  }

  /** Velocity of the recent motion, in scene units per second. @param {number} nowMs @returns {Vec3} */
  velocity(nowMs) {
    const last = this.trail[this.trail.length - 1];
    if (last.ms < nowMs - VELOCITY_MS) return [0, 0, 0];
    const [first] = this.trail;
    const span = Math.max(last.ms - Math.max(first.ms, last.ms - VELOCITY_MS), VELOCITY_MS_MIN);
    return scale(subtract(this.targetAt(last.at), this.targetAt(first.at)), 1000 / span);
  }

  /** Releases the particle. It keeps the velocity of its last step, but the last motion sent may have
   * ended by then, or not have begun. So the target first moves on at the velocity of the pointer, and
   * the release follows once the node has applied that. */
  end() {
    if (!this.isBegun) return;
    const { commands } = this.app;
    const { particle } = this;
    const velocity = this.velocity(performance.now());
    if (length(velocity) === 0) {
      this.tick(performance.now());
      this.release();
      return;
    }
    const target = addScaled(this.targetAt(this.pointer), velocity, OVER_S.max);
    commands.run("move", { particle, target, over_s: OVER_S.max }, () => this.release());
  }

  /** Releases the particle where it is. A reset or load ends only grabs that the node applied before it,
   * and the grab may have come later. */
  cancel() {
    if (this.isBegun) this.release();
  }

  release() {
    this.app.commands.run("release", { particle: this.particle });
  }

  describe() {
    return this.isBegun ? { line: { particle: this.particle, to: this.pointer } } : {};
  }
}
