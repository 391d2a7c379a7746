// Pointers and wheel on the picture: which tool a press begins, and when two fingers are the view's.

import { clamp } from "./math.js";
import { Brush, Hand, Knife, REACH, View, depthUnder, particleAt, togglePin } from "./tools.js";

/** @typedef {import("./pick.js").Pixel} Pixel */
/** @typedef {import("./tools.js").Tool} Tool */
/** @typedef {"grab" | "brush" | "cut" | "pin"} Mode */

export const MODES = /** @type {const} */ (["grab", "brush", "cut", "pin"]);
/** Radius of the brush in CSS pixels: as in the documents. */
export const BRUSH = { min: 20, max: 100, step: 10, start: 50 };
/** A finger that rests so long on a particle pins it. */
const LONG_PRESS_MS = 550;
/** What moves less than this is a press and no drag, CSS pixels. */
const SLACK = 6;
/** Part of the distance that one notch of a wheel (100 units) zooms by. */
const ZOOM_PER_UNIT = 0.0012;
/** Hovering asks for the nearest particle with each frame: only where that is quick. */
const HOVER_PARTICLES_MAX = 20_000;

export class Input {
  /** @param {HTMLCanvasElement} canvas @param {import("./tools.js").Bench} bench @param {() => boolean} canChange whether commands may change the simulation */
  constructor(canvas, bench, canChange) {
    this.canvas = canvas;
    this.bench = bench;
    this.canChange = canChange;
    /** @type {Mode} */
    this.mode = "grab";
    this.brushRadius = BRUSH.start;
    /** Where each pressed pointer is. @type {Map<number, Pixel>} */
    this.pointers = new Map();
    /** @type {Tool | null} */
    this.tool = null;
    /** Where the mouse is, null outside of the picture. @type {Pixel | null} */
    this.hover = null;
    /** @type {number | null} */
    this.hovered = null;
    this.isHoverStale = false;
    this.longPress = 0;
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const type of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
      canvas.addEventListener(type, (event) => this.lift(event));
    }
    canvas.addEventListener("pointerleave", () => this.leave());
    // Where each click pins, the second one has already undone the first.
    canvas.addEventListener("dblclick", (event) => { if (this.mode !== "pin") this.pinAt(this.pixel(event), REACH.mouse); });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.turnWheel(event), { passive: false });
  }

  /** @param {MouseEvent} event @returns {Pixel} */
  pixel(event) {
    const box = this.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** @param {PointerEvent} event */
  press(event) {
    const at = this.pixel(event);
    this.pointers.set(event.pointerId, at);
    this.canvas.setPointerCapture(event.pointerId);
    clearTimeout(this.longPress);
    if (this.pointers.size > 1) {
      // The second finger takes the first one's work away: two fingers move the view.
      this.finish();
      return;
    }
    this.tool = this.begin(event, at);
    if (event.pointerType === "touch" && this.tool instanceof Hand) this.waitForLongPress(this.tool);
    this.bench.renderer.isDirty = true;
  }

  /** @param {PointerEvent} event @param {Pixel} at @returns {Tool | null} */
  begin(event, at) {
    const { bench } = this;
    const reach = event.pointerType === "touch" ? REACH.touch : REACH.mouse;
    if (event.button === 1 || (event.button === 0 && event.shiftKey)) return new View(bench, at, "pan");
    if (event.button === 0 && event.altKey) return new View(bench, at, "orbit");
    if (!this.canChange()) return new View(bench, at, "orbit");
    if (event.button === 2 || this.mode === "cut") return new Knife(bench, at);
    if (this.mode === "brush") return depthUnder(bench, at, this.brushRadius) === null ? new View(bench, at, "orbit") : new Brush(bench, at, this.brushRadius);
    const particle = particleAt(bench, at, reach);
    if (particle === null) return new View(bench, at, "orbit");
    if (this.mode === "grab") return new Hand(bench, particle, at);
    togglePin(bench, particle);
    return null;
  }

  /** @param {Hand} hand */
  waitForLongPress(hand) {
    this.longPress = setTimeout(() => {
      if (this.tool !== hand || distance(hand.start, hand.pointer) > SLACK) return;
      this.finish();
      togglePin(this.bench, hand.particle);
      navigator.vibrate?.(15);
    }, LONG_PRESS_MS);
  }

  /** @param {PointerEvent} event */
  drag(event) {
    const at = this.pixel(event);
    if (event.pointerType !== "touch") this.hover = at;
    this.isHoverStale = true;
    const before = this.pointers.get(event.pointerId);
    if (before === undefined) return;
    if (this.pointers.size === 2) this.pinch(event.pointerId, before, at);
    this.pointers.set(event.pointerId, at);
    this.tool?.move(at);
  }

  /** Two fingers: what is between them stays between them. @param {number} id @param {Pixel} before @param {Pixel} at */
  pinch(id, before, at) {
    const { camera, renderer } = this.bench;
    const other = [...this.pointers].find(([one]) => one !== id)?.[1];
    if (other === undefined) return;
    const middle = { x: (at.x + other.x) / 2, y: (at.y + other.y) / 2 };
    camera.zoom(clamp(distance(at, other) / Math.max(distance(before, other), 1), 0.5, 2), middle.x, middle.y, renderer.viewport);
    camera.pan((at.x - before.x) / 2, (at.y - before.y) / 2, renderer.viewport);
    renderer.isDirty = true;
  }

  /** @param {PointerEvent} event */
  lift(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    clearTimeout(this.longPress);
    this.finish();
  }

  /** Ends the tool in use: its particle is let go. */
  finish() {
    this.tool?.end();
    this.tool = null;
    this.bench.renderer.isDirty = true;
  }

  /** The connection or the scene is gone: there is nobody left to let go of. */
  abandon() {
    this.tool = null;
    this.hovered = null;
  }

  leave() {
    this.hover = null;
    this.hovered = null;
  }

  /** @param {Pixel} at @param {number} reach */
  pinAt(at, reach) {
    const particle = this.canChange() ? particleAt(this.bench, at, reach) : null;
    if (particle !== null) togglePin(this.bench, particle);
    return particle !== null;
  }

  /** P over a particle, or while one is held. */
  pinHovered() {
    if (this.tool instanceof Hand) {
      togglePin(this.bench, this.tool.particle);
      return true;
    }
    return this.hover !== null && this.pinAt(this.hover, REACH.mouse);
  }

  /** @param {WheelEvent} event */
  turnWheel(event) {
    event.preventDefault();
    const { camera, renderer } = this.bench;
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    if (this.mode === "brush" && !event.ctrlKey) {
      this.brushRadius = clamp(this.brushRadius - Math.sign(event.deltaY) * BRUSH.step, BRUSH.min, BRUSH.max);
      if (this.tool instanceof Brush) this.tool.radius = this.brushRadius;
    } else {
      // A pinch on a touchpad comes as a wheel with ctrl, in much smaller units.
      const units = clamp(event.deltaY * lines, -300, 300) * (event.ctrlKey ? 5 : 1);
      const at = this.pixel(event);
      camera.zoom(Math.exp(-units * ZOOM_PER_UNIT), at.x, at.y, renderer.viewport);
    }
    renderer.isDirty = true;
  }

  /** Once an animation frame: what the tool has to send, and what the mouse is over. @param {number} nowMs */
  tick(nowMs) {
    this.tool?.tick(nowMs);
    if (!this.isHoverStale || this.tool !== null) return;
    this.isHoverStale = false;
    const isQuick = (this.bench.simulation.scene?.particleCount ?? 0) <= HOVER_PARTICLES_MAX;
    const canHold = this.hover !== null && isQuick && this.canChange() && (this.mode === "grab" || this.mode === "pin");
    this.hovered = canHold && this.hover !== null ? particleAt(this.bench, this.hover, REACH.mouse) : null;
    this.canvas.dataset.cursor = this.mode === "cut" ? "cut" : this.hovered === null ? this.mode : "over";
  }
}

/** @param {Pixel} a @param {Pixel} b */
const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);
