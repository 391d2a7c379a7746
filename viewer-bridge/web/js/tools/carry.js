// Carrying: moves a collider or an anchor along with the pointer, and releases it with the velocity of the pointer.

import { subtract } from "../geometry/math.js";
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
