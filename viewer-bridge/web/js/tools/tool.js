// The parts that all pointer tools share. Each tool sends at most one message per animation frame,
// however often the pointer moves.

import { particlesWithin, pickParticle } from "../geometry/pick.js";

/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** The parts of the page that tools act on. @typedef {{ simulation: import("../state/simulation.js").Simulation, camera: import("../geometry/camera.js").Camera, renderer: import("../gl/renderer.js").Renderer, commands: import("../net/commands.js").Commands, selection: import("../state/selection.js").Selection }} App */
/** A press. `end` completes it; `cancel` ends it when the scene changes under it, without its last motion.
 * @typedef {{ start: Pixel, move(to: Pixel, ms: number): void, tick(nowMs: number): void, end(ms: number): void, cancel(): void, describe(): Trace }} Tool */
/** The trace of a tool on the overlay. @typedef {{ line?: { particle: number, to: Pixel }, circle?: { at: Pixel, radius: number }, stroke?: Pixel[] }} Trace */

/** Radius in CSS pixels within which a mouse and a finger pick a particle. */
export const REACH = { mouse: 18, touch: 30 };
/** Least and greatest duration that a motion is spread over, in seconds. */
export const OVER_S = { min: 1 / 240, max: 0.25 };

/** Number of the last stroke of any tool. The commands of a stroke are undone together. */
let lastStroke = 0;

export const newStroke = () => ++lastStroke;

/** Changes without a press that follow each other within this time are undone together, in ms: keys on a slider, or a reset of several rows. */
const STROKE_MS = 1000;

/** The strokes of controls. All changes between a press and its release are one stroke, however long it takes. */
export class Strokes {
  constructor() {
    this.stroke = 0;
    this.isPressed = false;
    this.changedMs = -Infinity;
  }

  press() {
    this.stroke = newStroke();
    this.isPressed = true;
  }

  /** A later change belongs to another stroke. */
  release() {
    this.isPressed = false;
    this.changedMs = -Infinity;
  }

  /** The number of the stroke of a change. @param {number} nowMs */
  ofChange(nowMs) {
    if (!this.isPressed && nowMs - this.changedMs > STROKE_MS) this.stroke = newStroke();
    this.changedMs = nowMs;
    return this.stroke;
  }
}

/** The drawn particle at a pixel of the picture. @param {App} app @param {Pixel} at @param {number} reach */
export function particleAt({ simulation, camera, renderer }, at, reach) {
  if (simulation.frame === null) return null;
  return pickParticle(simulation.frame, camera.viewProjection(renderer.viewport), renderer.viewport, at, reach);
}

/** Position of the particle nearest to the eye within a circle: the depth at which a stroke moves. @param {App} app @param {Pixel} at @param {number} radius */
export function depthUnder({ simulation, camera, renderer }, at, radius) {
  if (simulation.frame === null) return null;
  const candidates = particlesWithin(simulation.frame, camera.viewProjection(renderer.viewport), renderer.viewport, at, radius);
  if (candidates.length === 0) return null;
  return simulation.position(candidates.reduce((best, one) => (one.w < best.w ? one : best)).particle);
}
