// Feedback of the pointer tools over the picture: a line from the grabbed particle to the pointer, the
// circle of the brush, the stroke of a cut. The particle itself is drawn where the simulation has it.

import { sharpContext } from "./dom.js";
import { identity, transform } from "../geometry/math.js";
import { ITEM_COLORS, nameOf } from "../state/selection.js";

/** @typedef {import("../geometry/pick.js").Pixel} Pixel */

const GRAB_COLOR = "#ff8a1f";
const CUT_COLOR = "#e03546";

export class Overlay {
  /** @param {HTMLCanvasElement} canvas @param {import("../tools/tool.js").App} app @param {import("../tools/input.js").Input} input */
  constructor(canvas, app, input) {
    this.canvas = canvas;
    this.app = app;
    this.input = input;
    this.isEmpty = true;
    /** The matrix to clip space. */
    this.view = identity();
  }

  draw() {
    const { input } = this;
    const trace = input.tool?.describe() ?? {};
    const circle = trace.circle ?? (input.mode === "brush" && input.hover !== null && input.canChange() ? { at: input.hover, radius: input.brushRadius } : undefined);
    const { items } = this.app.selection;
    const isEmpty = trace.line === undefined && trace.stroke === undefined && circle === undefined && input.hovered === null && items.length === 0;
    if (isEmpty && this.isEmpty) return;
    this.isEmpty = isEmpty;
    this.view = this.app.camera.viewProjection(this.app.renderer.viewport);
    const { context } = sharpContext(this.canvas);
    context.lineCap = context.lineJoin = "round";
    if (items.length > 0) this.selected(context, items);
    if (input.hovered !== null && input.tool === null) this.ring(context, input.hovered);
    if (trace.line !== undefined) this.line(context, trace.line.particle, trace.line.to);
    if (circle !== undefined) drawCircle(context, circle.at, circle.radius, trace.circle !== undefined);
    if (trace.stroke !== undefined) drawStroke(context, trace.stroke);
  }

  /** @param {number} particle */
  pixelOf(particle) {
    const at = this.app.simulation.position(particle);
    if (at === null) return null;
    const { width, height } = this.app.renderer.viewport;
    const [x, y, , w] = transform(this.view, at);
    return w <= 0 ? null : { x: ((x / w + 1) / 2) * width, y: ((1 - y / w) / 2) * height };
  }

  /** Marks the selected items in their colours, with their names. @param {CanvasRenderingContext2D} context @param {import("../state/selection.js").Item[]} items */
  selected(context, items) {
    const ends = this.app.simulation.scene?.ends ?? [];
    context.font = "600 12px system-ui, sans-serif";
    items.forEach((item, place) => {
      const [a, b] = (item.kind === "particle" ? [item.index] : [ends[2 * item.index], ends[2 * item.index + 1]]).map((one) => this.pixelOf(one));
      const color = ITEM_COLORS[place];
      if (a === null || b === null) return;
      if (item.kind === "particle") outline(context, () => context.arc(a.x, a.y, 7, 0, 2 * Math.PI), color, 2.5);
      else {
        outline(context, () => {
          context.moveTo(a.x, a.y);
          context.lineTo(b.x, b.y);
        }, color, 4);
      }
      label(context, nameOf(item), item.kind === "particle" ? a : { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 }, color);
    });
  }

  /** @param {CanvasRenderingContext2D} context @param {number} particle */
  ring(context, particle) {
    const at = this.pixelOf(particle);
    if (at === null) return;
    outline(context, () => context.arc(at.x, at.y, 8, 0, 2 * Math.PI), GRAB_COLOR, 2);
  }

  /** @param {CanvasRenderingContext2D} context @param {number} particle @param {Pixel} to */
  line(context, particle, to) {
    const from = this.pixelOf(particle);
    if (from === null) return;
    outline(context, () => {
      context.moveTo(from.x, from.y);
      context.lineTo(to.x, to.y);
    }, GRAB_COLOR, 2);
    outline(context, () => context.arc(to.x, to.y, 4, 0, 2 * Math.PI), GRAB_COLOR, 2);
  }
}

/** Writes a name beside a point, with a light rim that is visible on any background. @param {CanvasRenderingContext2D} context @param {string} text @param {Pixel} at @param {string} color */
function label(context, text, at, color) {
  context.lineWidth = 3.5;
  context.strokeStyle = "rgb(255 255 255 / 88%)";
  context.strokeText(text, at.x + 10, at.y - 8);
  context.fillStyle = `color-mix(in srgb, ${color}, black 35%)`;
  context.fillText(text, at.x + 10, at.y - 8);
}

/** Strokes a path with a thin dark outline, so that it is visible on any background. @param {CanvasRenderingContext2D} context @param {() => void} path @param {string} color @param {number} width */
function outline(context, path, color, width) {
  for (const [style, wide] of /** @type {const} */ ([["rgb(0 0 0 / 35%)", width + 2], [color, width]])) {
    context.beginPath();
    path();
    context.strokeStyle = style;
    context.lineWidth = wide;
    context.stroke();
  }
}

/** @param {CanvasRenderingContext2D} context @param {Pixel} at @param {number} radius @param {boolean} isPressed */
function drawCircle(context, at, radius, isPressed) {
  context.beginPath();
  context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
  context.fillStyle = isPressed ? "rgb(255 138 31 / 26%)" : "rgb(255 138 31 / 12%)";
  context.fill();
  outline(context, () => context.arc(at.x, at.y, radius, 0, 2 * Math.PI), GRAB_COLOR, 1.5);
}

/** Draws a stroke that fades towards its start. @param {CanvasRenderingContext2D} context @param {Pixel[]} stroke */
function drawStroke(context, stroke) {
  for (let i = 1; i < stroke.length; i++) {
    context.globalAlpha = i / stroke.length;
    outline(context, () => {
      context.moveTo(stroke[i - 1].x, stroke[i - 1].y);
      context.lineTo(stroke[i].x, stroke[i].y);
    }, CUT_COLOR, 2.5);
  }
  context.globalAlpha = 1;
}
