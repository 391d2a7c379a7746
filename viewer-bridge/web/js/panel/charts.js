// The measurements: four small plots, redrawn with each STATS message, and figures below them.

import { cssColor, make, sharpContext } from "../ui/dom.js";
import { niceCeiling } from "../geometry/round.js";
import { readable } from "../ui/format.js";
import { Series } from "./series.js";

/** Capacity of the series: 20 s of frames, and 20 s of STATS messages (four per second). */
const FRAME_SAMPLES = 1200;
const STATS_SAMPLES = 80;

/** @typedef {{ name: string, series: Series, color: string }} Line */
/** @typedef {{ title: string, unit: string, lines: Line[], limit: (() => number) | null, canvas: HTMLCanvasElement, output: HTMLOutputElement, text: () => string, lastTop: number }} Chart */

export class Charts {
  /** @param {HTMLElement} element @param {HTMLElement} figures @param {import("../state/simulation.js").Simulation} simulation */
  constructor(element, figures, simulation) {
    this.simulation = simulation;
    this.figures = figures;
    const [solve, wake] = [new Series(FRAME_SAMPLES), new Series(FRAME_SAMPLES)];
    const [most, mean, kinetic, potential, total] = Array.from({ length: 5 }, () => new Series(STATS_SAMPLES));
    const stats = () => simulation.stats;
    this.charts = [
      chart("Solve time", "µs", [{ name: "step", series: solve, color: "--plot-a" }], () => stats()?.periodUs ?? NaN,
        () => `${readable(stats()?.solveUsP50 ?? NaN, "µs")} of ${readable(stats()?.periodUs ?? NaN, "µs")}`),
      chart("Wake-up delay", "µs", [{ name: "late", series: wake, color: "--plot-b" }], null,
        () => `99 %: ${readable(stats()?.wakeLateUsP99 ?? NaN, "µs")}`),
      chart("Stretch", "%", [{ name: "maximum", series: most, color: "--plot-b" }, { name: "mean", series: mean, color: "--plot-a" }], null,
        () => `max ${readable(most.last(), "%")}, mean ${readable(mean.last(), "%")}`),
      chart("Energy", "J", [{ name: "potential", series: potential, color: "--plot-c" }, { name: "kinetic", series: kinetic, color: "--plot-a" }, { name: "sum", series: total, color: "--plot-b" }], null,
        () => `kinetic ${readable(kinetic.last(), "J")}, sum ${readable(total.last(), "J")}`),
    ];
    element.replaceChildren(...this.charts.map((one) => make("div", { class: "plot" }, make("h3", {}, one.title, one.output), one.canvas)));
    simulation.on("frame", (frame) => {
      if (simulation.isLookingBack) return;
      solve.push(frame.solveUs);
      wake.push(frame.wakeLateUs);
    });
    simulation.on("stats", (now) => {
      most.push(now.stretchMax);
      mean.push(now.stretchMean);
      kinetic.push(now.kineticJ);
      potential.push(now.potentialJ);
      total.push(now.kineticJ + now.potentialJ);
      this.draw();
    });
    for (const topic of /** @type {const} */ (["node", "connection"])) simulation.on(topic, () => { if (!simulation.isAlive) this.clear(); });
    simulation.on("scene", () => this.charts.forEach((one) => one.lines.forEach((line) => line.series.clear())));
  }

  draw() {
    if (this.charts[0].canvas.clientWidth === 0) return;
    for (const one of this.charts) drawChart(one);
    this.drawFigures();
  }

  /** Removes the numbers of a node that is gone. The plots end there. */
  clear() {
    for (const one of this.charts) one.output.textContent = "";
    this.figures.replaceChildren();
  }

  drawFigures() {
    const { stats } = this.simulation;
    if (stats === null) return;
    const rows = [
      ["Real-time factor", `${stats.realTimeFactor.toFixed(2)} of ${stats.timeScale.toFixed(2)}`],
      ["Late steps, skipped", `${stats.lateSteps}, ${stats.skippedPeriods}`],
      ["Torn, frozen", `${stats.tornCount}, ${stats.frozenCount}`],
      ["Commands, rejected", `${stats.outcomes}, ${stats.rejected}`],
      ["Readers, pages", `${stats.readers}, ${stats.clients}`],
      ["Frames", `${readable(stats.framesPerSecond, "/s")}, ${readable(stats.encodeUs, "µs")} each`],
    ];
    this.figures.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
  }
}

/** @param {string} title @param {string} unit @param {Line[]} lines @param {(() => number) | null} limit @param {() => string} text @returns {Chart} */
function chart(title, unit, lines, limit, text) {
  const label = `${title}: ${lines.map((line) => line.name).join(", ")}`;
  return { title, unit, lines, limit, text, canvas: make("canvas", { role: "img", "aria-label": label }), output: make("output", { "aria-live": "off" }), lastTop: 0 };
}

/** @param {Chart} one */
function drawChart(one) {
  one.output.textContent = one.text();
  const { context, width, height } = sharpContext(one.canvas);
  const { bottom, top } = scaleOf(one);
  const y = (/** @type {number} */ value) => height - 4 - ((value - bottom) / (top - bottom)) * (height - 8);
  context.lineWidth = 1;
  if (bottom < 0) rule(context, width, y(0), cssColor("--line"), []);
  if (one.limit !== null && one.limit() <= top) rule(context, width, y(one.limit()), cssColor("--accent"), [4, 3]);
  for (const { series, color } of one.lines) drawLine(context, series.columns(Math.min(Math.floor(width), series.samples.length)), width, y, cssColor(color));
  context.fillStyle = cssColor("--soft");
  context.font = "10px system-ui, sans-serif";
  context.fillText(readable(top, one.unit), 4, 11);
}

/** Round ends of the scale. It grows at once, and shrinks only when less than a third is used. @param {Chart} one */
function scaleOf(one) {
  const ranges = one.lines.map((line) => line.series.range()).filter((range) => range !== null);
  const least = Math.min(0, ...ranges.map((range) => range.min));
  const limit = one.limit?.() ?? NaN;
  const greatest = Math.max(0, ...ranges.map((range) => range.max));
  // The deadline is in range only once the solver comes near it; otherwise it would flatten the plot.
  const wanted = niceCeiling(greatest > 0.2 * limit ? Math.max(greatest, limit * 1.1) : greatest);
  one.lastTop = wanted > one.lastTop || wanted < one.lastTop * 0.3 ? wanted : one.lastTop;
  return { bottom: least < 0 ? -niceCeiling(-least) : 0, top: one.lastTop };
}

/** @param {CanvasRenderingContext2D} context @param {number} width @param {number} y @param {string} color @param {number[]} dash */
function rule(context, width, y, color, dash) {
  context.setLineDash(dash);
  context.strokeStyle = color;
  context.beginPath();
  context.moveTo(0, y);
  context.lineTo(width, y);
  context.stroke();
  context.setLineDash([]);
}

/** Draws a band from minimum to maximum in each column, so that a single peak is visible. @param {CanvasRenderingContext2D} context @param {import("./series.js").Column[]} columns @param {number} width @param {(value: number) => number} y @param {string} color */
function drawLine(context, columns, width, y, color) {
  context.strokeStyle = color;
  context.lineWidth = 1.4;
  context.beginPath();
  let isDown = false;
  columns.forEach((column, index) => {
    if (column === null) {
      isDown = false;
      return;
    }
    const x = ((index + 0.5) / columns.length) * width;
    if (isDown) context.lineTo(x, y(column.max));
    else context.moveTo(x, y(column.max));
    context.lineTo(x, y(column.min));
    isDown = true;
  });
  context.stroke();
}
