// The scale of the force arrows.

import { find } from "../ui/dom.js";
import { readable } from "../ui/format.js";
import { sceneUnits } from "../ui/units.js";
import { niceFloor } from "../geometry/round.js";
import { FORCE_COLOR } from "../gl/theme.js";

/** Longest arrow of the legend, in CSS pixels. */
const LENGTH_MAX = 120;

export class ForceLegend {
  /** @param {import("../tools/tool.js").App} app */
  constructor(app) {
    this.app = app;
    this.legend = find("force-legend", HTMLElement);
    this.arrow = find("force-arrow", HTMLElement);
    this.scale = find("force-scale", HTMLOutputElement);
  }

  /** Shows the scale at the middle of the view. */
  tick() {
    const { simulation, renderer } = this.app;
    const isWanted = renderer.toggles.forces && simulation.isConnected;
    if (this.legend.hidden === isWanted) this.legend.hidden = !isWanted;
    if (isWanted) this.show();
  }

  /** The legend for a picture, or null if it is not shown. @returns {import("./legend-text.js").LegendText | null} */
  describe() {
    if (this.legend.hidden) return null;
    return { title: `Force ${this.scale.textContent}`, arrow: { length: Number.parseFloat(this.arrow.style.width) || 0, color: FORCE_COLOR }, lines: [] };
  }

  show() {
    const { camera, renderer, simulation } = this.app;
    const unitsPerNewton = renderer.unitsPerNewton();
    const newtonsPerPixel = camera.unitsPerPixel(camera.target, renderer.viewport) / unitsPerNewton;
    const newtons = niceFloor(LENGTH_MAX * newtonsPerPixel);
    const width = simulation.forces === null || unitsPerNewton === 0 ? 0 : newtons / newtonsPerPixel;
    setText(this.scale, width === 0 ? absence(simulation) : readable(newtons, sceneUnits(simulation.scene).force));
    const pixels = `${width.toFixed(1)}px`;
    if (this.arrow.style.width !== pixels) this.arrow.style.width = pixels;
  }
}

/** Says why there are no arrows. @param {import("../state/simulation.js").Simulation} simulation */
function absence({ forces, isReplay, isPaused }) {
  if (forces !== null) return "no force";
  if (isReplay) return "none recorded of this step";
  return isPaused ? "after the next step" : "waiting";
}

/** @param {HTMLElement} element @param {string} text */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
