// The line of figures under the picture. It changes four times a second at most: faster is not read,
// and a screen reader would never stop.

import { trim } from "./plot.js";

const INTERVAL_MS = 250;

export class Hud {
  /** @param {HTMLOutputElement} output @param {import("./state.js").Simulation} simulation @param {import("./gl/renderer.js").Renderer} renderer */
  constructor(output, simulation, renderer) {
    this.output = output;
    this.simulation = simulation;
    this.renderer = renderer;
    this.saidMs = 0;
    this.drawnBefore = 0;
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    const elapsed = nowMs - this.saidMs;
    if (elapsed < INTERVAL_MS) return;
    const drawn = this.renderer.framesDrawn - this.drawnBefore;
    this.saidMs = nowMs;
    this.drawnBefore = this.renderer.framesDrawn;
    const text = this.text(Math.round((drawn * 1000) / elapsed));
    if (this.output.textContent !== text) this.output.textContent = text;
  }

  /** @param {number} picturesPerSecond */
  text(picturesPerSecond) {
    const { frame, scene, stats, torn } = this.simulation;
    if (frame === null || scene === null) return "";
    const factor = stats === null || !Number.isFinite(stats.realTimeFactor) ? "" : ` · ${trim(stats.realTimeFactor)} × real time`;
    // What stands still is drawn when something asks for it: that is no rate.
    const pace = this.simulation.isPaused ? " · paused" : `${factor} · ${picturesPerSecond} pictures/s`;
    const tears = torn.length > 0 ? ` · ${torn.length} torn` : "";
    return `step ${frame.step} · ${frame.simTime.toFixed(2)} s${pace} · ${scene.particleCount} particles · ${scene.constraintCount} constraints${tears}`;
  }
}
