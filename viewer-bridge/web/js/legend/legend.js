// The legends: the scale of the colours, and the scale of the force arrows.

import { niceEnd, niceFloor } from "../geometry/math.js";
import { FORCE_COLOR, HEAT_STOPS, KIND_COLORS } from "../gl/theme.js";
import { valueOf } from "../net/messages.js";
import { KINDS, strainGains, tensionGains } from "../state/quantity.js";
import { find, make, sharpContext } from "../ui/dom.js";
import { readable, sceneUnits } from "../ui/format.js";
import { ValueScan } from "./value-scan.js";

/**
 * `ends` are the values below the ramp of colours, from its left to its right end.
 * @typedef {{ title: string, ends?: string[], kinds?: { text: string, color: string }[], arrow?: { length: number, color: string }, lines: string[] }} LegendText
 */

/** The texts of elements that are shown and not empty. @param {HTMLElement[]} elements */
export const shownTexts = (...elements) => elements.filter((one) => !one.hidden).map((one) => one.textContent ?? "").filter((text) => text !== "");

/** @typedef {import("../state/quantity.js").Quantity} Quantity */
/** @typedef {import("./value-scan.js").Extremes} Extremes */

/** Time between two scans of a moving scene, in ms. */
const SCAN_INTERVAL_MS = 250;
/** Rounding of a 32-bit coordinate, relative to its size. */
const FLOAT_ROUNDING = 2 ** -23;
/** Least length of an automatic scale, in roundings of a value: a scene at rest is not coloured by the rounding of its
 * positions, which moves a particle by less than one rounding in most substeps. */
const ROUNDINGS_MIN = 4;
/** Least length of an automatic scale of the strain: its labels have thousandths of a percent. */
const STRAIN_MIN = 5e-5;
/** The scale shrinks once its values have used less than this part of it, for this number of scans (2 s). A value that
 * swings, as in a flag, reaches its greatest again within that time. */
const USED_MIN = 0.6;
const SHRINK_SCANS = 8;
/** If the smaller end is at least this part of the other one, both become equal: the middle of the scale is 0. */
const EQUAL_SHARE = 0.5;
/** Ends that a user can choose, in the unit of the quantity. @type {Record<Quantity, number[]>} */
const ENDS = { strain: [0.01, 0.05, 0.2, 1], tension: [0.1, 1, 10, 100], speed: [0.1, 1, 10], kind: [] };
/** An end that is smaller than this part of the other one is noise: the scale begins at 0. */
const NOISE_SHARE = 0.02;
/** The rounding of positions is mentioned from this part of the scale on. */
const RESOLUTION_SHARE = 0.05;

export class ColorLegend {
  /** @param {import("../tools/tool.js").App} app */
  constructor(app) {
    this.app = app;
    this.element = find("legend", HTMLElement);
    this.choice = find("colour", HTMLSelectElement);
    this.range = find("heat-range", HTMLSelectElement);
    this.ramp = find("ramp", HTMLCanvasElement);
    this.ends = find("heat-ends", HTMLElement);
    this.extremes = find("heat-extremes", HTMLOutputElement);
    this.kinds = find("heat-kinds", HTMLElement);
    this.note = find("heat-note", HTMLElement);
    this.scan = new ValueScan();
    this.begunMs = -Infinity;
    /** The ends of the automatic scale, as magnitudes. */
    this.low = new ScaleEnd();
    this.high = new ScaleEnd();
    /** The frame of the last scan: a paused scene is scanned once. @type {object | null} */
    this.scanned = null;
    /** The inputs from which the gains of the topology were computed. */
    this.gainsFor = "";
    /** Speeds of the scanned frame. @type {import("../net/wire.js").Speeds | null} */
    this.speeds = null;
    this.isShown = false;
    this.choice.addEventListener("change", () => this.choose(/** @type {Quantity} */ (this.choice.value)));
    this.range.addEventListener("change", () => this.fit());
    const { simulation } = app;
    simulation.on("scene", () => this.begin());
    for (const topic of /** @type {const} */ (["parameters", "node"])) simulation.on(topic, () => this.updateGains());
    // The next scan leaves out what is torn.
    simulation.on("tear", () => { this.scanned = null; });
  }

  get quantity() {
    return this.app.renderer.coloring.quantity;
  }

  /** Colours by another quantity. @param {Quantity} quantity */
  choose(quantity) {
    this.app.renderer.coloring.quantity = quantity;
    this.choice.value = quantity;
    this.begin();
  }

  /** Starts with another scene or quantity. */
  begin() {
    const { quantity } = this;
    this.low = new ScaleEnd();
    this.high = new ScaleEnd();
    this.gainsFor = "";
    this.range.replaceChildren(make("option", { value: "auto" }, "auto"), ...ENDS[quantity].map((end) => make("option", { value: end }, `to ${readable(end, this.unit())}`)));
    this.range.hidden = quantity === "kind";
    this.updateGains();
    this.rescan();
    this.isShown = false;
  }

  /** Unit of the quantity. */
  unit() {
    const units = sceneUnits(this.app.simulation.scene);
    return { strain: "%", tension: units.force, speed: units.speed, kind: "" }[this.quantity];
  }

  /** Gives the topology the gains of the quantity, if they have changed. */
  updateGains() {
    const { simulation, renderer } = this.app;
    const { topology, scene, node, parameters } = simulation;
    if (topology === null || scene === null || !renderer.toggles.heat) return;
    const isTension = this.quantity === "tension";
    const key = isTension ? JSON.stringify([scene.epoch, node?.method, parameters?.values?.compliance]) : `${scene.epoch}`;
    if (key === this.gainsFor || (this.quantity !== "strain" && !isTension)) return;
    this.gainsFor = key;
    topology.setGains(isTension ? tensionGains(scene, parameters?.values ?? null, node?.method ?? null) : strainGains(scene));
    renderer.invalidate({ topology: true });
    this.rescan();
  }

  rescan() {
    this.scan.restart();
    this.scanned = null;
    this.begunMs = -Infinity;
  }

  /** Scans the values, and shows what has changed. @param {number} nowMs */
  tick(nowMs) {
    const { renderer, simulation } = this.app;
    const isWanted = renderer.toggles.heat && simulation.scene !== null;
    if (this.element.hidden === isWanted) this.element.hidden = !isWanted;
    if (!isWanted) {
      this.isShown = false;
      return;
    }
    if (!this.isShown) {
      this.isShown = true;
      this.choice.value = this.quantity;
      this.updateGains();
      this.show();
    }
    if (this.quantity !== "kind") this.scanSome(nowMs);
  }

  /** @param {number} nowMs */
  scanSome(nowMs) {
    const { scan } = this;
    const { frame, scene, topology, speeds } = this.app.simulation;
    if (frame === null || scene === null || topology === null) return;
    if (!scan.isRunning) {
      if (nowMs - this.begunMs < SCAN_INTERVAL_MS || (this.quantity === "speed" && speeds === null)) return;
      this.begunMs = nowMs;
      // A paused scene is not scanned again, but its scale still shrinks.
      if (this.scanned === frame) return this.fit();
      this.scanned = frame;
      this.speeds = speeds;
      scan.begin(frame);
    }
    const isDone = this.quantity === "speed" ? scan.addValues(this.speeds?.speeds ?? new Float32Array(0)) : scan.addConstraints(scene, topology.gains, topology.isGone);
    if (isDone) this.fit();
  }

  /** Sets the ends of the scale: those chosen, or round numbers around 98 of 100 values. */
  fit() {
    const { coloring } = this.app.renderer;
    const { low, high } = this.scan.found ?? { low: 0, high: 0 };
    this.low.follow(-low);
    this.high.follow(this.low.value > this.least() ? high : Math.max(high, this.least()));
    const scale = scaleOf(this.low.value, this.high.value, this.range.value === "auto" ? null : Number(this.range.value));
    if (coloring.low !== scale.low || coloring.high !== scale.high) this.app.renderer.isDirty = true;
    Object.assign(coloring, scale);
    this.show();
  }

  /** Least length of an automatic scale: a few times what rounding can change in a value. */
  least() {
    const { simulation } = this.app;
    const { gainMax, resolution } = this.scan.found ?? { gainMax: 0, resolution: 0 };
    const rounding = FLOAT_ROUNDING * (Math.hypot(...simulation.middle()) + simulation.radius());
    if (this.quantity === "speed") {
      // The solver computes a velocity from the change of a position within a substep.
      const substeps = Number(valueOf(simulation.parameters?.values ?? null, "substeps", ""));
      return ROUNDINGS_MIN * rounding * (simulation.node?.rate_hz ?? 0) * substeps;
    }
    return Math.max(ROUNDINGS_MIN * Math.max(resolution, rounding * gainMax), this.quantity === "strain" ? STRAIN_MIN : 0);
  }

  show() {
    const { quantity } = this;
    const isKind = quantity === "kind";
    for (const one of [this.ramp, this.ends, this.extremes]) one.hidden = isKind;
    this.kinds.hidden = !isKind;
    setText(this.note, isKind ? "" : this.doubt());
    this.note.hidden = this.note.textContent === "";
    if (isKind) return this.showKinds();
    const { low, high } = this.app.renderer.coloring;
    const unit = this.unit();
    const [first, middle, last] = this.ends.children;
    const texts = [low, (low + high) / 2, high].map((value) => (value === 0 ? "0" : readable(value, unit)));
    [first, middle, last].forEach((one, place) => setText(one, texts[place]));
    const { found } = this.scan;
    if (found !== null) setText(this.extremes, found.known === 0 ? "no known value" : `min ${readable(found.min, unit)}, max ${readable(found.max, unit)}`);
    else setText(this.extremes, "");
    drawRamp(this.ramp);
  }

  /** Names what the colours do not show, or returns "". */
  doubt() {
    const { found } = this.scan;
    const { quantity } = this;
    if (quantity === "speed" || found === null) return "";
    const { low, high } = this.app.renderer.coloring;
    const rounding = found.resolution > RESOLUTION_SHARE * (high - low) ? ` Positions are rounded: ±${readable(found.resolution, this.unit())}.` : "";
    return `${quantity === "tension" ? tensionNote(found, this.app.simulation.node?.method ?? null) : ""}${rounding}`.trim();
  }

  /** The legend for a picture, or null if it is not shown. @returns {LegendText | null} */
  describe() {
    if (this.element.hidden) return null;
    const title = this.choice.selectedOptions[0]?.textContent ?? "";
    const kinds = [...this.kinds.children].map((one) => ({ text: one.textContent ?? "", color: one.querySelector("i")?.style.background ?? "" }));
    if (this.quantity === "kind") return { title, kinds, lines: [] };
    const ends = [...this.ends.children].map((one) => one.textContent ?? "");
    return { title, ends, lines: shownTexts(this.extremes, this.note) };
  }

  showKinds() {
    const { scene } = this.app.simulation;
    const counts = KINDS.map(() => 0);
    for (const kind of scene?.constraintKinds ?? []) counts[kind]++;
    this.kinds.replaceChildren(...KINDS.flatMap((name, kind) => {
      if (counts[kind] === 0) return [];
      const swatch = make("i", { "aria-hidden": "true" });
      swatch.style.background = KIND_COLORS[kind];
      return [make("li", {}, swatch, `${name}: ${counts[kind]}`)];
    }));
  }
}

/** An end of a scale: a round number. It grows at once, and shrinks once several scans in a row used little of it. */
export class ScaleEnd {
  constructor() {
    this.value = 0;
    /** The number of scans in a row that used little of the scale, and the greatest value in them. */
    this.scans = 0;
    this.greatest = 0;
  }

  /** @param {number} measured */
  follow(measured) {
    const isLow = measured < this.value * USED_MIN;
    this.scans = isLow ? this.scans + 1 : 0;
    this.greatest = isLow ? Math.max(this.greatest, measured) : 0;
    if (measured > this.value) this.value = niceEnd(measured);
    if (this.scans < SHRINK_SCANS) return;
    this.value = niceEnd(this.greatest);
    this.scans = this.greatest = 0;
  }
}

/**
 * The scale from the magnitudes of the automatic ends, with 0 in it. A chosen end holds for the sides that have values.
 * @param {number} below @param {number} above @param {number | null} chosen
 */
export function scaleOf(below, above, chosen) {
  const isBelow = below > NOISE_SHARE * above;
  const isAbove = above > NOISE_SHARE * below || !isBelow;
  if (chosen === null && Math.min(below, above) >= EQUAL_SHARE * Math.max(below, above)) below = above = Math.max(below, above);
  return { low: isBelow ? -(chosen ?? below) : 0, high: isAbove ? chosen ?? (above || 1) : 0 };
}

/** Says of which constraints the tension is known. @param {Extremes} found @param {string | null} method */
export function tensionNote({ known, count }, method) {
  if (method === "pbd") return "The method pbd has no forces: tensions are not defined.";
  const law = "(length − rest length) / compliance: exact at rest.";
  if (known === 0) return "All constraints are rigid: positions do not show their tensions. Set a compliance, or show forces (N).";
  return known < count ? `${law} Rigid or torn, so unknown: ${count - known} of ${count} constraints.` : law;
}

/** @param {Element} element @param {string} text */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @param {HTMLCanvasElement} canvas */
function drawRamp(canvas) {
  const { context, width, height } = sharpContext(canvas);
  const ramp = context.createLinearGradient(0, 0, width, 0);
  HEAT_STOPS.forEach((color, stop) => ramp.addColorStop(stop / (HEAT_STOPS.length - 1), color));
  context.fillStyle = ramp;
  context.fillRect(0, 0, width, height);
}

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

  /** The legend for a picture, or null if it is not shown. @returns {LegendText | null} */
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
