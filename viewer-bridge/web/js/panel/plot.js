// Draws one plot: the lines of its series in a window of simulation time.

import { niceCeiling } from "../geometry/math.js";
import { make, sharpContext } from "../ui/dom.js";
import { readable } from "../ui/format.js";

/** @typedef {{ name: string, series: Series, color: string }} Line  colour as "#rrggbb" or a custom property */
/** @typedef {{ from: number, to: number, cursor: number | null, gap: number }} Window  in s; samples farther apart than `gap` are not joined */
/** A plot. `fits` leaves out zero where the values are far from it; `limit` is a line across the plot.
 * @typedef {{ title: string, unit: () => string, lines: Line[], fits: boolean, limit: (() => number) | null, text: (() => string) | null }} PlotSpec */

export class Plot {
  /** @param {PlotSpec} spec */
  constructor(spec) {
    this.spec = spec;
    this.canvas = make("canvas", { "aria-hidden": "true" });
    this.output = make("output", { "aria-live": "off" });
    /** The values of the lines, in their colours. */
    this.values = spec.lines.map(({ color }) => {
      const value = make("span");
      value.style.setProperty("--swatch", color.startsWith("--") ? `var(${color})` : color);
      return value;
    });
    this.output.classList.toggle("has-swatches", this.values.length > 1);
    this.output.append(...this.values);
    this.element = make("div", { class: "plot" }, make("h3", {}, spec.title, this.output), this.canvas);
    this.lastTop = 0;
    /** The lines while the plots are held: copies. @type {Line[] | null} */
    this.held = null;
  }

  get lines() {
    return this.held ?? this.spec.lines;
  }

  /** @param {boolean} isHeld */
  hold(isHeld) {
    this.held = isHeld ? this.spec.lines.map((line) => ({ ...line, series: line.series.clone() })) : null;
  }

  /** The values at a time, with the names of the lines. @param {number} time @param {number} reach */
  textsAt(time, reach) {
    return this.lines.map(({ name, series }) => `${name} ${readable(series.near(time, reach), this.spec.unit())}`);
  }

  /** @param {number} time @param {number} reach */
  textAt(time, reach) {
    return this.textsAt(time, reach).join(", ");
  }

  /** @param {string[]} texts */
  show(texts) {
    texts.forEach((text, index) => {
      const shown = index < texts.length - 1 ? `${text}, ` : text;
      if (this.values[index].textContent !== shown) this.values[index].textContent = shown;
    });
  }

  /** @param {Window} window */
  draw({ from, to, cursor, gap }) {
    this.show(cursor !== null ? this.textsAt(cursor, gap) : this.held === null && this.spec.text !== null ? [this.spec.text()] : this.textsAt(to, Infinity));
    const { context, width, height } = sharpContext(this.canvas);
    const style = getComputedStyle(this.canvas);
    const color = (/** @type {string} */ name) => (name.startsWith("--") ? style.getPropertyValue(name) : name);
    const { bottom, top } = this.scale(from, to);
    const y = (/** @type {number} */ value) => height - 4 - ((value - bottom) / (top - bottom)) * (height - 8);
    const limit = this.spec.limit?.() ?? NaN;
    context.lineWidth = 1;
    if (bottom < 0 && top > 0) rule(context, 0, y(0), width, y(0), color("--line"), []);
    if (limit <= top) rule(context, 0, y(limit), width, y(limit), color("--accent"), [4, 3]);
    for (const line of this.lines) drawLine(context, line.series, { from, to, cursor, gap }, width, y, color(line.color));
    if (cursor !== null) {
      const x = ((cursor - from) / (to - from)) * width;
      rule(context, x, 0, x, height, color("--text"), []);
    }
    context.fillStyle = color("--soft");
    context.font = "10px system-ui, sans-serif";
    context.fillText(readable(top, this.spec.unit()), 4, 11);
    if (bottom !== 0) context.fillText(readable(bottom, this.spec.unit()), 4, height - 4);
  }

  /** Round ends of the scale. It grows at once, and shrinks only when less than a third is used. @param {number} from @param {number} to */
  scale(from, to) {
    let [least, greatest] = [Infinity, -Infinity];
    for (const { series } of this.lines) {
      const range = series.range(from, to);
      if (range === null) continue;
      least = Math.min(least, range.min);
      greatest = Math.max(greatest, range.max);
    }
    if (least > greatest) return { bottom: 0, top: 1 };
    if (this.spec.fits) {
      const step = niceCeiling(Math.max(greatest - least, Math.abs(greatest) * 1e-4) / 4);
      return { bottom: Math.floor(least / step) * step, top: Math.ceil(greatest / step + 1e-9) * step || step };
    }
    const limit = this.spec.limit?.() ?? NaN;
    // A limit is in range only once the values come near it; otherwise it would flatten the plot.
    const wanted = niceCeiling(greatest > 0.2 * limit ? Math.max(greatest, limit * 1.1) : Math.max(greatest, 0));
    this.lastTop = wanted > this.lastTop || wanted < this.lastTop * 0.3 ? wanted : this.lastTop;
    return { bottom: least < 0 ? -niceCeiling(-least) : 0, top: this.lastTop };
  }
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} toX @param {number} toY @param {string} color @param {number[]} dash */
function rule(context, x, y, toX, toY, color, dash) {
  context.setLineDash(dash);
  context.strokeStyle = color;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(toX, toY);
  context.stroke();
  context.setLineDash([]);
}

/** Draws from the maximum to the minimum of the samples in each column of pixels, so that a single peak is visible.
 * @param {CanvasRenderingContext2D} context @param {Series} series @param {Window} window @param {number} width @param {(value: number) => number} y @param {string} color */
export function drawLine(context, series, { from, to, gap }, width, y, color) {
  context.strokeStyle = color;
  context.lineWidth = 1.4;
  context.beginPath();
  // The middles of pixels become whole numbers: a fraction would allocate a number for every column.
  context.translate(0.5, 0);
  // No closure changes these: such variables would allocate a number for every sample.
  let column = -1;
  let min = Infinity;
  let max = -Infinity;
  let before = -Infinity;
  let isDown = false;
  for (let index = Math.max(series.indexFrom(from) - 1, 0); index < series.size; index++) {
    const time = series.timeAt(index);
    if (time > to) break;
    const value = series.valueAt(index);
    const at = Math.floor(((time - from) / (to - from)) * width);
    const isBroken = Number.isNaN(value) || time - before > gap;
    if (at !== column || isBroken) {
      if (min <= max) drawColumn(context, column, y(max), y(min), isDown);
      isDown = !isBroken && (isDown || min <= max);
      column = at;
      min = Infinity;
      max = -Infinity;
    }
    if (value < min) min = value;
    if (value > max) max = value;
    before = time;
  }
  if (min <= max) drawColumn(context, column, y(max), y(min), isDown);
  context.translate(-0.5, 0);
  context.stroke();
}

/** Goes on from the maximum to the minimum of a column. Without a column before it, a single value is a dot.
 * @param {CanvasRenderingContext2D} context @param {number} column @param {number} top @param {number} bottom @param {boolean} isDown */
function drawColumn(context, column, top, bottom, isDown) {
  if (isDown) context.lineTo(column, top);
  else context.moveTo(column, top);
  context.lineTo(column, bottom + (top === bottom && !isDown ? 1 : 0));
}

/** @typedef {{ min: number, max: number } | null} Range  null without a sample */

export class Series {
  /** @param {number} capacity number of samples kept */
  constructor(capacity) {
    this.times = new Float64Array(capacity);
    this.values = new Float64Array(capacity);
    /** Place of the oldest sample in the ring. */
    this.first = 0;
    this.size = 0;
  }

  /** Adds a sample. Those at or after its time are dropped: a replay has gone back, or a step is shown again.
   * @param {number} time in s @param {number} value NaN if unknown */
  push(time, value) {
    while (this.size > 0 && this.timeAt(this.size - 1) >= time) this.size--;
    if (this.size === this.times.length) this.first = (this.first + 1) % this.times.length;
    else this.size++;
    const place = this.place(this.size - 1);
    this.times[place] = time;
    this.values[place] = value;
  }

  clear() {
    this.first = this.size = 0;
  }

  /** A copy that later samples do not change. */
  clone() {
    const copy = new Series(this.times.length);
    copy.times.set(this.times);
    copy.values.set(this.values);
    [copy.first, copy.size] = [this.first, this.size];
    return copy;
  }

  /** @param {number} index 0 is the oldest sample */
  place(index) {
    return (this.first + index) % this.times.length;
  }

  /** @param {number} index */
  timeAt(index) {
    return this.times[this.place(index)];
  }

  /** @param {number} index */
  valueAt(index) {
    return this.values[this.place(index)];
  }

  /** The newest sample, or NaN before the first. */
  last() {
    return this.size === 0 ? NaN : this.valueAt(this.size - 1);
  }

  /** Index of the first sample at or after a time. @param {number} time */
  indexFrom(time) {
    let [low, high] = [0, this.size];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.timeAt(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The sample nearest to a time, or NaN if none is within `reach`. @param {number} time @param {number} reach in s */
  near(time, reach) {
    const after = this.indexFrom(time);
    const before = after - 1;
    const isBefore = before >= 0 && (after === this.size || time - this.timeAt(before) < this.timeAt(after) - time);
    const index = isBefore ? before : after;
    return index < this.size && Math.abs(this.timeAt(index) - time) <= reach ? this.valueAt(index) : NaN;
  }

  /** Minimum and maximum of the samples in a window, without NaN. @param {number} from @param {number} to @returns {Range} */
  range(from, to) {
    let [min, max] = [Infinity, -Infinity];
    for (let index = this.indexFrom(from); index < this.size && this.timeAt(index) <= to; index++) {
      const value = this.valueAt(index);
      if (value < min) min = value;
      if (value > max) max = value;
    }
    return min <= max ? { min, max } : null;
  }
}
