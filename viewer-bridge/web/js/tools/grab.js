// The grab: drives one particle to the pointer, and releases it with the velocity of the pointer.

import { addScaled, length } from "../geometry/math.js";
import { PressTool } from "./press-tool.js";
import { OVER_S } from "./tool.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").App} App */
/** @typedef {import("./tool.js").Tool} Tool */

/** Grabs a particle. Its target is where the pointer meets the camera-facing plane through it. @implements {Tool} */
export class GrabTool extends PressTool {
  /** @param {App} app @param {number} particle @param {Pixel} start */
  constructor(app, particle, start) {
    super(app, start, /** @type {Vec3} */ (app.simulation.position(particle)), particle);
    this.grabbed = particle;
  }

  request() {
    const { simulation, commands } = this.app;
    const target = simulation.position(this.grabbed) ?? this.targetAt(this.start);
    this.setOrigin(target);
    commands.run("grab", { particle: this.grabbed, target }, ({ status }) => { this.isRefused = status !== "applied"; });
  }

  /** @param {Vec3} target @param {number} over_s */
  send(target, over_s) {
    this.app.commands.stream("move", { particle: this.grabbed, target, over_s });
  }

  /** Releases the particle. It keeps the velocity of its last step, but the last motion sent may have
   * ended by then, or not have begun. So the target first moves on at the velocity of the pointer, and
   * the release follows once the node has applied that. @param {number} ms */
  end(ms) {
    if (!this.isBegun) return;
    const velocity = this.velocity(ms);
    if (length(velocity) === 0) {
      this.tick(performance.now());
      this.release();
      return;
    }
    const target = addScaled(this.targetAt(this.pointer), velocity, OVER_S.max);
    this.app.commands.run("move", { particle: this.grabbed, target, over_s: OVER_S.max }, () => this.release());
  }

  /** Releases the particle where it is. A reset or load ends only grabs that the node applied before it,
   * and the grab may have come later. */
  cancel() {
    if (this.isBegun) this.release();
  }

  release() {
    this.app.commands.run("release", { particle: this.grabbed });
  }
}
