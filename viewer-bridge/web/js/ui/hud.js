// The status line under the picture. It changes at most four times a second: nobody reads faster, and
// screen readers announce every change.

import { trim, sceneUnits } from "./format.js";

const INTERVAL_MS = 250;

export class Hud {
  /** @param {HTMLOutputElement} output @param {import("../state/simulation.js").Simulation} simulation @param {import("../gl/renderer.js").Renderer} renderer */
  constructor(output, simulation, renderer) {
    this.output = output;
    this.simulation = simulation;
    this.renderer = renderer;
    this.updatedMs = 0;
    this.drawnBefore = 0;
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    const elapsed = nowMs - this.updatedMs;
    if (elapsed < INTERVAL_MS) return;
    const drawn = this.renderer.framesDrawn - this.drawnBefore;
    this.updatedMs = nowMs;
    this.drawnBefore = this.renderer.framesDrawn;
    const text = this.text(Math.round((drawn * 1000) / elapsed));
    if (this.output.textContent !== text) this.output.textContent = text;
  }

  /** @param {number} drawnPerSecond */
  text(drawnPerSecond) {
    const { frame, ghost, scene, stats, torn } = this.simulation;
    if (frame === null || scene === null) return "";
    const factor = stats === null || !Number.isFinite(stats.realTimeFactor) ? "" : ` · ${trim(stats.realTimeFactor)} × real time`;
    // A paused scene is drawn on demand, so it has no meaningful rate.
    const pace = this.simulation.isLookingBack ? " · in the past" : !this.simulation.isAlive ? " · last state" : this.simulation.isPaused ? " · paused" : `${factor} · ${drawnPerSecond} fps`;
    const tears = torn.length > 0 ? ` · ${torn.length} torn` : "";
    return `step ${frame.step} · ${frame.simTime.toFixed(2)} s${pace} · ${scene.particleCount} particles · ${scene.constraintCount} constraints${tears}${ghost === null ? "" : ` · ${apart(ghost, sceneUnits(scene).length)}`}`;
  }
}

/** The distance of the ghost from the state on show. @param {import("../net/wire.js").Ghost} ghost @param {string} unit of length */
function apart({ distance, farthest, step }, unit) {
  if (Number.isNaN(distance)) return `ghost at step ${step}`;
  return distance === 0 ? "ghost at the same place" : `ghost up to ${trim(distance)} ${unit} away (particle ${farthest})`;
}
