// Strokes of the pointer: the brush, which pushes all particles within a circle, and the cut.

import { clamp, subtract } from "../geometry/math.js";
import { crossedSticks, projectAll } from "../geometry/pick.js";
import { depthUnder, newStroke, OVER_S } from "./tool.js";

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

/** Points of a stroke that stay drawn. */
const STROKE_POINTS_MAX = 60;

/** Cuts every constraint that meets the pointer, whichever of the two moves. @implements {Tool} */
export class CutTool {
  /** @param {App} app @param {Pixel} start */
  constructor(app, start) {
    this.app = app;
    this.start = start;
    /** @type {Pixel[]} */
    this.stroke = [start];
    /** Path of the pointer since the last check, from its position then. @type {Pixel[]} */
    this.path = [start];
    /** Frame and scene of the last check. */
    this.frame = app.simulation.frame;
    this.scene = app.simulation.scene;
    /** Constraints that were sent already. @type {Set<number>} */
    this.sent = new Set();
    this.number = newStroke();
  }

  /** @param {Pixel} to */
  move(to) {
    this.path.push(to);
    this.stroke.push(to);
    if (this.stroke.length > STROKE_POINTS_MAX) this.stroke.shift();
  }

  tick() {
    const { simulation, camera, renderer, commands } = this.app;
    const { frame, scene, topology } = simulation;
    if (frame === null || scene === null || topology === null) return;
    if (this.path.length === 1 && frame === this.frame) return;
    const past = scene === this.scene && this.frame !== null ? this.frame : frame;
    // The present camera projects both frames, so that turning the view does not count as motion.
    const [now, before] = [frame, past].map((one) => projectAll(one, camera.viewProjection(renderer.viewport), renderer.viewport));
    const crossed = crossedSticks(now, before, scene.ends, topology.isGone, this.path).filter((one) => !this.sent.has(one));
    this.path = this.path.slice(-1);
    [this.frame, this.scene] = [frame, scene];
    const countMax = simulation.hello?.limits.constraints_per_cut ?? 256;
    for (let first = 0; first < crossed.length; first += countMax) {
      const constraints = crossed.slice(first, first + countMax);
      const isSent = commands.run("cut_constraints", { epoch: scene.epoch, constraints, stroke: this.number }, ({ status }) => {
        if (status === "applied" && simulation.isPaused) simulation.expectCut(scene.epoch, constraints);
      });
      if (isSent) for (const one of constraints) this.sent.add(one);
    }
  }

  end() {
    this.tick();
  }

  cancel() {}

  describe() {
    return { stroke: this.stroke };
  }
}
