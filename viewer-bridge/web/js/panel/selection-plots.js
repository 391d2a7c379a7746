// The values of the selection as plots. A series lives as long as its item is selected.

import { dot } from "../geometry/math.js";
import { distanceOf, inspectConstraint, inspectParticle } from "../state/inspection.js";
import { ITEM_COLORS, nameOf } from "../state/selection.js";
import { sceneUnits } from "../ui/format.js";
import { Plot, Series } from "./plot.js";

/** @typedef {import("../state/selection.js").Item} Item */

export class SelectionPlots {
  /** @param {import("../tools/tool.js").App} app @param {number} capacity */
  constructor(app, capacity) {
    this.app = app;
    this.capacity = capacity;
    /** By the title of the plot and the name of the item. @type {Map<string, Series>} */
    this.series = new Map();
    /** @type {Plot[]} */
    this.plots = [];
  }

  /** Builds the plots of the present selection. */
  rebuild() {
    const { items } = this.app.selection;
    const units = () => sceneUnits(this.app.simulation.scene);
    const kept = this.series;
    this.series = new Map();
    const line = (/** @type {string} */ title, /** @type {string} */ name, /** @type {string} */ color) => {
      const key = `${title} ${name}`;
      const series = kept.get(key) ?? new Series(this.capacity);
      this.series.set(key, series);
      return { name, series, color };
    };
    const plot = (/** @type {string} */ title, /** @type {Item["kind"]} */ kind, /** @type {() => string} */ unit, fits = false) => {
      const lines = items.flatMap((item, place) => (item.kind === kind ? [line(title, nameOf(item), ITEM_COLORS[place])] : []));
      return lines.length === 0 ? [] : [new Plot({ title, unit, lines, fits, limit: null, text: null })];
    };
    const isPair = items.length === 2 && items.every(({ kind }) => kind === "particle");
    const pair = isPair ? [new Plot({ title: "Distance", unit: () => units().length, lines: [line("Distance", items.map(nameOf).join("–"), ITEM_COLORS[0])], fits: true, limit: null, text: null })] : [];
    this.plots = [
      ...plot("Height of particle", "particle", () => units().length, true), ...plot("Speed of particle", "particle", () => units().speed), ...pair,
      ...plot("Strain of constraint", "constraint", () => "%"), ...plot("Tension of constraint", "constraint", () => units().force),
    ];
  }

  clear() {
    for (const series of this.series.values()) series.clear();
  }

  /** Adds the values of the frame. @param {number} time */
  add(time) {
    const { simulation, selection } = this.app;
    const { items } = selection;
    for (const item of items) {
      const name = nameOf(item);
      if (item.kind === "particle") {
        const values = inspectParticle(simulation, item.index);
        this.push("Height of particle", name, time, values === null ? NaN : dot(values.position, simulation.axes().up));
        this.push("Speed of particle", name, time, values?.speed ?? NaN);
      } else {
        const values = inspectConstraint(simulation, item.index);
        this.push("Strain of constraint", name, time, values === null || values.cause !== null ? NaN : values.strain);
        this.push("Tension of constraint", name, time, values?.tension ?? NaN);
      }
    }
    if (items.length === 2) this.push("Distance", items.map(nameOf).join("–"), time, distanceOf(simulation, items[0].index, items[1].index) ?? NaN);
  }

  /** @param {string} title @param {string} name @param {number} time @param {number} value */
  push(title, name, time, value) {
    this.series.get(`${title} ${name}`)?.push(time, value);
  }
}
