// The plots: those of the user first, those of the solver folded away. All share one axis of simulation time,
// a cursor, and a button that holds them.

import { find, make, save } from "../ui/dom.js";
import { readable, sceneUnits } from "../ui/format.js";
import { Plot, Series } from "./plot.js";
import { SelectionPlots } from "./selection-plots.js";

/** Capacity of the series: two minutes of frames, and of STATS messages (four per second). */
const FRAME_SAMPLES = 7200;
const STATS_SAMPLES = 480;
/** Time without a sample at which a line is interrupted, in s at the pace of real time. */
const GAP_S = 1.5;
/** Motion of the cursor per arrow key, as a part of the window. */
const CURSOR_STEP = 0.01;

export class Charts {
  /** @param {import("../tools/tool.js").App} app @param {import("../ui/banner.js").Banner} banner */
  constructor(app, banner) {
    this.app = app;
    this.banner = banner;
    this.figures = find("figures", HTMLElement);
    this.box = find("plots", HTMLElement);
    this.span = find("plot-span", HTMLSelectElement);
    this.holdButton = find("plot-hold", HTMLButtonElement);
    this.axis = find("plot-axis", HTMLOutputElement);
    this.said = find("plot-said", HTMLElement);
    this.series = seriesOf();
    this.own = this.userPlots();
    this.solver = this.solverPlots();
    this.selected = new SelectionPlots(app, FRAME_SAMPLES);
    /** All plots, in their order. @type {Plot[]} */
    this.plots = [];
    /** Simulation time at the right end. */
    this.now = 0;
    /** The right end while the plots are held. @type {number | null} */
    this.heldAt = null;
    /** @type {number | null} */
    this.cursor = null;
    /** Plots of this round that are drawn, one in every second animation frame. All of a round have the same window. */
    this.drawn = 0;
    this.isStale = true;
    /** The next animation frame draws no plot. */
    this.isDrawing = false;
    /** @type {import("./plot.js").Window} */
    this.round = { from: 0, to: 0, cursor: null, gap: GAP_S };
    find("solver-plots", HTMLElement).replaceChildren(...this.solver.map((one) => one.element));
    this.arrange();
    this.listen();
  }

  userPlots() {
    const { simulation } = this.app;
    const units = () => sceneUnits(simulation.scene);
    const { lowest, highest, most, mean, kinetic, potential, total, torn } = this.series;
    const plot = (/** @type {string} */ title, /** @type {() => string} */ unit, /** @type {import("./plot.js").Line[]} */ lines, fits = false) => new Plot({ title, unit, lines, fits, limit: null, text: null });
    return [
      plot("Height", () => units().length, [{ name: "highest", series: highest, color: "--plot-a" }, { name: "lowest", series: lowest, color: "--plot-b" }], true),
      plot("Stretch", () => "%", [{ name: "max", series: most, color: "--plot-b" }, { name: "mean", series: mean, color: "--plot-a" }]),
      plot("Energy", () => units().energy, [{ name: "potential", series: potential, color: "--plot-c" }, { name: "kinetic", series: kinetic, color: "--plot-a" }, { name: "sum", series: total, color: "--plot-b" }]),
      plot("Torn", () => "", [{ name: "constraints", series: torn, color: "--plot-b" }]),
    ];
  }

  solverPlots() {
    const stats = () => this.app.simulation.stats;
    const { solve, wake } = this.series;
    const plot = (/** @type {string} */ title, /** @type {import("./plot.js").Line} */ line, /** @type {(() => number) | null} */ limit, /** @type {() => string} */ text) => new Plot({ title, unit: () => "µs", lines: [line], fits: false, limit, text });
    return [
      plot("Solve time", { name: "step", series: solve, color: "--plot-a" }, () => stats()?.periodUs ?? NaN, () => `${readable(stats()?.solveUsP50 ?? NaN, "µs")} of ${readable(stats()?.periodUs ?? NaN, "µs")}`),
      plot("Wake-up delay", { name: "late", series: wake, color: "--plot-b" }, null, () => `99 %: ${readable(stats()?.wakeLateUsP99 ?? NaN, "µs")}`),
    ];
  }

  listen() {
    const { simulation, selection } = this.app;
    simulation.on("frame", (frame) => this.addFrame(frame));
    simulation.on("stats", (stats) => this.addStats(stats));
    simulation.on("scene", () => this.clear());
    for (const topic of /** @type {const} */ (["node", "connection"])) simulation.on(topic, () => { if (!simulation.isAlive) this.figures.replaceChildren(); });
    selection.on("change", () => this.arrange());
    this.holdButton.addEventListener("click", () => this.hold(this.heldAt === null));
    find("plot-csv", HTMLButtonElement).addEventListener("click", () => this.saveCsv());
    this.span.addEventListener("change", () => this.redraw());
    find("solver", HTMLDetailsElement).addEventListener("toggle", () => this.redraw());
    for (const box of [this.box, find("solver-plots", HTMLElement)]) {
      box.addEventListener("pointermove", (event) => this.point(event));
      box.addEventListener("pointerleave", () => this.setCursor(null));
    }
    this.box.addEventListener("keydown", (event) => this.onKey(event));
    this.box.addEventListener("blur", () => this.setCursor(null));
  }

  /** Puts the plots of the selection after those of the scene. */
  arrange() {
    this.selected.rebuild();
    if (this.heldAt !== null) this.selected.plots.forEach((one) => one.hold(true));
    this.plots = [...this.own, ...this.selected.plots, ...this.solver];
    this.box.replaceChildren(...this.own.map((one) => one.element), ...this.selected.plots.map((one) => one.element));
    this.redraw();
  }

  clear() {
    for (const series of Object.values(this.series)) series.clear();
    this.selected.clear();
    this.hold(false);
  }

  /** @param {import("../net/wire.js").Frame} frame */
  addFrame(frame) {
    const { simulation } = this.app;
    // The plots go on to show the present while the page looks back, but its frames are not shown.
    if (simulation.isLookingBack) return;
    const time = frame.simTime;
    const { low, high } = heights(frame, simulation.axes().up);
    this.series.lowest.push(time, low);
    this.series.highest.push(time, high);
    this.series.torn.push(time, frame.tornCount);
    this.series.solve.push(time, frame.solveUs);
    this.series.wake.push(time, frame.wakeLateUs);
    this.selected.add(time);
    this.now = time;
    if (this.heldAt === null) this.redraw();
  }

  /** @param {import("../net/wire.js").Stats} stats */
  addStats(stats) {
    const { scene } = this.app.simulation;
    if (scene === null || stats.epoch !== scene.epoch) return;
    const time = stats.step / Math.max(scene.rateHz, 1);
    const { most, mean, kinetic, potential, total } = this.series;
    most.push(time, stats.stretchMax);
    mean.push(time, stats.stretchMean);
    kinetic.push(time, stats.kineticJ);
    potential.push(time, stats.potentialJ);
    total.push(time, stats.kineticJ + stats.potentialJ);
    this.drawFigures(stats);
  }

  /** Stops the plots, so that they can be read. Samples are still recorded. @param {boolean} isHeld */
  hold(isHeld) {
    this.heldAt = isHeld ? this.now : null;
    this.holdButton.setAttribute("aria-pressed", String(isHeld));
    for (const one of this.plots) one.hold(isHeld);
    this.redraw();
  }

  /** @returns {import("./plot.js").Window} */
  window() {
    const { simulation } = this.app;
    const span = Number(this.span.value);
    // Nothing is before time 0.
    const to = Math.max(this.heldAt ?? this.now, span);
    const pace = simulation.isReplay ? simulation.playback?.rate ?? 1 : simulation.stats?.timeScale ?? 1;
    return { from: to - span, to, cursor: this.cursor, gap: GAP_S * Math.max(1, pace || 1) };
  }

  redraw() {
    this.isStale = true;
  }

  /** Draws one plot in every second animation frame, so that none takes long: six plots are new five times a second. */
  tick() {
    const { plots } = this;
    this.isDrawing = !this.isDrawing;
    if (!this.isDrawing) return;
    if (this.drawn >= plots.length) {
      if (!this.isStale || document.body.classList.contains("panel-away")) return;
      this.isStale = false;
      this.drawn = 0;
      this.round = this.window();
      this.showAxis(this.round);
    }
    this.drawPlot(plots[this.drawn++], this.round);
  }

  /** @param {Plot} plot @param {import("./plot.js").Window} window */
  drawPlot(plot, window) {
    if (plot.canvas.clientWidth > 0) plot.draw(window);
  }

  /** @param {import("./plot.js").Window} window */
  showAxis({ from, to, cursor }) {
    const rate = this.app.simulation.scene?.rateHz ?? 1;
    const text = cursor === null ? `${from.toFixed(2)} s to ${to.toFixed(2)} s` : `${cursor.toFixed(3)} s, step ${Math.round(cursor * rate)}`;
    if (this.axis.textContent !== text) this.axis.textContent = text;
  }

  /** @param {PointerEvent} event */
  point(event) {
    const canvas = event.target instanceof Element ? event.target.closest(".plot")?.querySelector("canvas") : null;
    if (!canvas) return;
    const { from, to } = this.window();
    const box = canvas.getBoundingClientRect();
    const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    this.setCursor(from + share * (to - from));
  }

  /** Moves the cursor with the arrow keys, and reads the values out. @param {KeyboardEvent} event */
  onKey(event) {
    const way = { ArrowLeft: -1, ArrowRight: 1, Escape: 0 }[event.key];
    if (way === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    if (way === 0) return this.setCursor(null);
    const { from, to, gap } = this.window();
    const cursor = Math.min(to, Math.max(from, (this.cursor ?? to) + way * CURSOR_STEP * (to - from)));
    this.setCursor(cursor);
    this.said.textContent = `At ${cursor.toFixed(2)} s: ${[...this.own, ...this.selected.plots].map((one) => `${one.spec.title}: ${one.textAt(cursor, gap)}`).join("; ")}`;
  }

  /** @param {number | null} time */
  setCursor(time) {
    if (time === this.cursor) return;
    this.cursor = time;
    const window = this.window();
    for (const one of this.plots) this.drawPlot(one, window);
    this.showAxis(window);
  }

  /** All samples of the plots; of held ones, those on show. */
  csv() {
    const columns = this.plots.flatMap((one) => one.lines.map(({ name, series }) => ({ name: `${one.spec.title} ${name}${one.spec.unit() === "" ? "" : ` (${one.spec.unit() === "%" ? "1" : one.spec.unit()})`}`, series })));
    return csvOf(columns, this.app.simulation.scene?.rateHz ?? 1);
  }

  saveCsv() {
    const { simulation } = this.app;
    if (simulation.frame === null) return this.banner.notify("The plots have no values yet.", "warning");
    save(new Blob([this.csv()], { type: "text/csv" }), `${simulation.scene?.name || "catenary"}-${simulation.frame.step}.csv`);
  }

  /** @param {import("../net/wire.js").Stats} stats */
  drawFigures(stats) {
    if (this.figures.clientWidth === 0) return;
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

/** The series of the scene and the solver. */
function seriesOf() {
  const frames = () => new Series(FRAME_SAMPLES);
  const stats = () => new Series(STATS_SAMPLES);
  return { lowest: frames(), highest: frames(), torn: frames(), solve: frames(), wake: frames(), most: stats(), mean: stats(), kinetic: stats(), potential: stats(), total: stats() };
}

/** The heights of the bounding box of a frame along an axis. @param {import("../net/wire.js").Frame} frame @param {import("../geometry/math.js").Vec3} up */
export function heights({ bounds: { min, max }, particleCount }, up) {
  if (particleCount === 0) return { low: NaN, high: NaN };
  const axis = up.findIndex((one) => one !== 0);
  const a = min[axis] * up[axis];
  const b = max[axis] * up[axis];
  return { low: Math.min(a, b), high: Math.max(a, b) };
}

/** @typedef {{ name: string, series: import("./plot.js").Series }} Column */

/** @param {Column[]} columns @param {number} rateHz steps per second */
export function csvOf(columns, rateHz) {
  const lines = [["time_s", "step", ...columns.map(({ name }) => name)].map(quoted).join(",")];
  const next = columns.map(() => 0);
  for (;;) {
    const times = columns.map(({ series }, k) => (next[k] < series.size ? series.timeAt(next[k]) : Infinity));
    const time = Math.min(...times, Infinity);
    if (time === Infinity) return `${lines.join("\r\n")}\r\n`;
    const cells = columns.map(({ series }, k) => {
      if (times[k] !== time) return "";
      const value = series.valueAt(next[k]++);
      return Number.isFinite(value) ? String(value) : "";
    });
    lines.push([Number(time.toPrecision(12)), Math.round(time * rateHz), ...cells].join(","));
  }
}

/** @param {string} cell */
const quoted = (cell) => (/[",\r\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell);
