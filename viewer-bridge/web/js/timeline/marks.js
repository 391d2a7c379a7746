// The marks of a timeline: their legend, whose entries switch them off and on, their tooltips, and the way from one to
// the next.

import { cssColor, find, make, sharpContext } from "../ui/dom.js";
import { Scale, clockText, marksByPixel } from "./timeline.js";

/** @typedef {import("../net/messages.js").Mark} Mark */
/** @typedef {import("./timeline.js").Track} Track */

/** Colour, row and name per kind of mark. @type {Record<string, [color: string, row: number, name: string]>} */
const KINDS = {
  tear: ["--accent", 0, "torn"],
  pin: ["--plot-a", 1, "pins"],
  command: ["--plot-c", 1, "commands"],
  late: ["--plot-b", 2, "late steps"],
  ghost: ["--ghost", 2, "first difference"],
};
/** Kinds that are switched off at first. A busy machine has thousands of late steps. */
const OFF_AT_FIRST = ["late"];
const ROW_HEIGHT = 5;
/** Distance in pixels at which the pointer is at a mark. */
const NEAR = 4;
const TOOLTIP_LINES_MAX = 8;

/** One line about a mark. @param {Mark} mark @param {(step: number) => string} clock */
export function describe({ kind, step, count, commands = [] }, clock) {
  return `${clock(step)}, step ${step}: ${what(kind, count, commands)}`;
}

/** @param {string} kind @param {number} count @param {string[]} commands */
function what(kind, count, commands) {
  if (kind === "tear") return `${count} ${count === 1 ? "constraint" : "constraints"} torn`;
  if (kind === "ghost") return "the ghost differs from here on";
  if (kind === "late") return `${count} late ${count === 1 ? "step" : "steps"}`;
  const names = commands.join(", ") || kind;
  return count > Math.max(1, commands.length) ? `${names} (${count} commands)` : names;
}

/** The step of the nearest mark after a place, or before it if `direction` is negative. @param {Mark[]} marks @param {number} place @param {number} direction @returns {number | null} */
export function stepOfMark(marks, place, direction) {
  const steps = marks.map(({ step }) => step).filter((step) => (direction < 0 ? step < place : step > place));
  if (steps.length === 0) return null;
  return steps.reduce((best, step) => (direction < 0 ? Math.max(best, step) : Math.min(best, step)));
}

/** The marks within some pixels of a position, nearest first. @param {Mark[]} marks @param {Scale} scale @param {number} x @param {number} width */
export function marksAt(marks, scale, x, width) {
  const distance = (/** @type {Mark} */ { step }) => Math.abs(scale.fraction(step) * width - x);
  return marks.filter((mark) => scale.has(mark.step) && distance(mark) <= NEAR).sort((a, b) => distance(a) - distance(b));
}

/** The kinds that occur among marks, in the order of the legend, with the number of their events. @param {Mark[]} marks */
export function legendOf(marks) {
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const { kind, count } of marks) counts.set(kind, (counts.get(kind) ?? 0) + count);
  const kinds = Object.keys(KINDS).filter((kind) => counts.has(kind));
  return kinds.map((kind) => ({ kind, text: kind === "ghost" ? KINDS[kind][2] : `${KINDS[kind][2]} ${counts.get(kind)}` }));
}

/** The row of marks above the slider. */
export class MarkRow {
  /** @param {(step: number) => void} onPick is called with the step of a mark that the user clicks @param {() => void} onSwitch is called when the user switches a kind off or on */
  constructor(onPick, onSwitch) {
    this.onSwitch = onSwitch;
    /** Kinds that are switched off: neither drawn nor stopped at. */
    this.off = new Set(OFF_AT_FIRST);
    /** Kinds in the legend, with their counts, as it shows them. */
    this.listed = "";
    this.canvas = find("marks", HTMLCanvasElement);
    this.legend = find("mark-legend", HTMLUListElement);
    /** @type {Mark[]} */
    this.marks = [];
    this.scale = new Scale(0, 0);
    /** @type {(step: number) => string} */
    this.clock = clockText;
    const near = (/** @type {PointerEvent | MouseEvent} */ event) => marksAt(this.marks, this.scale, event.offsetX, this.canvas.clientWidth);
    this.canvas.addEventListener("pointermove", (event) => {
      const lines = near(event).map((mark) => describe(mark, this.clock));
      this.canvas.classList.toggle("is-at-mark", lines.length > 0);
      if (lines.length > TOOLTIP_LINES_MAX) lines.splice(TOOLTIP_LINES_MAX, Infinity, "…");
      this.canvas.title = lines.join("\n");
    });
    this.canvas.addEventListener("click", (event) => {
      const [mark] = near(event);
      if (mark !== undefined) onPick(mark.step);
    });
  }

  /** Returns whether the marks are drawn for another range. @param {number} first @param {number} last */
  isOutside(first, last) {
    return this.scale.first !== first || this.scale.last !== last;
  }

  /** The marks of the kinds that are switched on. @param {Mark[]} marks */
  shown(marks) {
    return marks.filter(({ kind }) => !this.off.has(kind));
  }

  /** Draws the marks of a track in a range, and the part that it repeats. @param {Track} track @param {Scale} scale */
  draw(track, scale) {
    const { marks, looped } = track;
    const { context, width } = sharpContext(this.canvas);
    this.scale = scale;
    const inside = marks.filter(({ step }) => scale.has(step));
    this.marks = this.shown(inside);
    this.clock = (step) => clockText(track.sinceBegin(step));
    if (looped !== null) {
      const [from, to] = looped.map((step) => scale.fraction(step) * width);
      context.fillStyle = cssColor("--line");
      context.fillRect(from, 0, Math.max(2, to - from), 3 * ROW_HEIGHT);
    }
    for (const [kind, pixels] of marksByPixel(this.marks, scale, width)) {
      const [color, row] = KINDS[kind] ?? ["--soft", 1];
      context.fillStyle = cssColor(color);
      for (const pixel of pixels.keys()) context.fillRect(pixel - 0.5, row * ROW_HEIGHT, 2, ROW_HEIGHT - 1);
    }
    this.showLegend(inside);
  }

  /** Shows the colours of the kinds that have marks, with the number of their events. @param {Mark[]} marks */
  showLegend(marks) {
    const entries = legendOf(marks);
    const listed = entries.map(({ text }) => text).join();
    if (this.listed === listed) return;
    this.listed = listed;
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.kind : undefined;
    this.legend.replaceChildren(...entries.map(({ kind, text }) => make("li", {}, this.legendSwitch(kind, text))));
    if (focused !== undefined) /** @type {HTMLElement | null} */ (this.legend.querySelector(`[data-kind=${focused}]`))?.focus();
  }

  /** The entry of a kind: a switch for its marks. @param {string} kind @param {string} text */
  legendSwitch(kind, text) {
    const button = make("button", { type: "button", "data-kind": kind, "aria-pressed": String(!this.off.has(kind)), title: "Show these marks, and stop at them" }, text);
    button.style.setProperty("--swatch", `var(${KINDS[kind][0]})`);
    button.addEventListener("click", () => {
      if (!this.off.delete(kind)) this.off.add(kind);
      button.setAttribute("aria-pressed", String(!this.off.has(kind)));
      this.onSwitch();
    });
    return button;
  }
}
