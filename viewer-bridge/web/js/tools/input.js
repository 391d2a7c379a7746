// Pointer and wheel input on the picture: a press starts a tool, two fingers move the view.

import { clamp, length, subtract } from "../geometry/math.js";
import { BrushTool, CutTool } from "./strokes.js";
import { CarryTool, anchorOf, solidAt } from "./carry.js";
import { CLICK_MS, CLICK_PIXELS, PressTool } from "./press-tool.js";
import { GrabTool } from "./grab.js";
import { Notches } from "./notches.js";
import { togglePin, togglePins, itemAt } from "./click.js";
import { REACH, depthUnder, particleAt } from "./tool.js";
import { ViewTool } from "./view.js";

/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").Tool} Tool */
/** @typedef {"grab" | "brush" | "cut" | "pin"} Mode */

export const MODES = /** @type {const} */ (["grab", "brush", "cut", "pin"]);
/** Radius of the brush, in CSS pixels. */
export const BRUSH = { min: 20, max: 100, step: 10, start: 50 };
/** Duration after which a finger that rests on a particle pins it. */
const LONG_PRESS_MS = 550;
/** Limit on the motion of a press that still counts as at rest, in CSS pixels. */
const SLACK = 6;
/** A timer that fires this late was held up, and a release may wait behind it: the finger gets as long again. */
const LATE_MS = 40;
/** Exponent of the zoom factor per unit of the wheel; a notch is 100 units. */
const ZOOM_PER_UNIT = 0.0012;
/** Limit on particles for hovering, which picks what is under the mouse once per frame. */
const HOVER_PARTICLES_MAX = 20_000;
/** The same for the triangles of a solid. */
const HOVER_TRIANGLES_MAX = 20_000;
/** Distance from which a particle is behind a solid, relative to the distance of that from the eye. */
const BEHIND = 0.05;

export class Input {
  /** @param {HTMLCanvasElement} canvas @param {import("./tool.js").App} app @param {() => boolean} canChange returns true if commands may change the simulation */
  constructor(canvas, app, canChange) {
    this.canvas = canvas;
    this.app = app;
    this.canChange = canChange;
    /** @type {Mode} */
    this.mode = "grab";
    this.brushRadius = BRUSH.start;
    this.notches = new Notches();
    /** Position of each pressed pointer. @type {Map<number, Pixel>} */
    this.pointers = new Map();
    /** @type {Tool | null} */
    this.tool = null;
    /** Position of the mouse, or null outside the picture. @type {Pixel | null} */
    this.hover = null;
    /** @type {number | null} */
    this.hovered = null;
    this.isHoverStale = false;
    this.longPress = 0;
    /** The press that is a click so far. @type {Pixel | null} */
    this.click = null;
    /** Called when the mode changes. */
    this.onMode = () => {};
    /** Called when a tool begins to change the simulation. */
    this.onTouch = () => {};
    /** Number of tools that have begun to change the simulation. */
    this.touches = 0;
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const type of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
      canvas.addEventListener(type, (event) => this.release(event));
    }
    canvas.addEventListener("pointerleave", () => this.leave());
    // In pin mode, each click already toggles the pin.
    canvas.addEventListener("dblclick", (event) => { if (this.mode !== "pin") this.pinAt(this.pixel(event), REACH.mouse); });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.turnWheel(event), { passive: false });
    this.app.simulation.on("scene", () => this.cancel());
    this.app.simulation.on("reset", () => this.cancel());
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
      this.click = null;
      // A second finger ends the tool of the first: two fingers move the view.
      this.finish();
      return;
    }
    this.tool = this.begin(event, at);
    if (this.tool instanceof PressTool) this.tool.setPressed(event.timeStamp);
    const isView = this.tool instanceof ViewTool;
    this.click = event.button === 0 && (isView || this.tool instanceof PressTool) && (this.mode === "grab" || !this.canChange()) ? at : null;
    if (!isView) {
      this.touches += 1;
      this.onTouch();
    }
    if (event.pointerType === "touch" && this.tool instanceof PressTool) this.waitForLongPress(this.tool, event.timeStamp + LONG_PRESS_MS);
    this.app.renderer.isDirty = true;
  }

  /** @param {PointerEvent} event @param {Pixel} at @returns {Tool | null} */
  begin(event, at) {
    const { app } = this;
    const reach = event.pointerType === "touch" ? REACH.touch : REACH.mouse;
    if (event.button === 1 || (event.button === 0 && event.shiftKey)) return new ViewTool(app, at, "pan");
    if (event.button === 0 && event.altKey) return new ViewTool(app, at, "orbit");
    if (!this.canChange()) return new ViewTool(app, at, "orbit");
    if (event.button === 2 || this.mode === "cut") return new CutTool(app, at);
    if (this.mode === "brush") return depthUnder(app, at, this.brushRadius) === null ? new ViewTool(app, at, "orbit") : new BrushTool(app, at, this.brushRadius);
    const particle = particleAt(app, at, reach);
    if (this.mode === "grab") return pressToolAt(app, at, particle) ?? new ViewTool(app, at, "orbit");
    if (particle === null) return new ViewTool(app, at, "orbit");
    togglePin(app, particle);
    return null;
  }

  /** Pins the particle of a press that is still at rest at a time. @param {PressTool & Tool} tool @param {number} dueMs */
  waitForLongPress(tool, dueMs) {
    this.longPress = setTimeout(() => {
      const now = performance.now();
      if (now - dueMs > LATE_MS) return this.waitForLongPress(tool, now + LATE_MS);
      if (this.pinPressed(tool)) globalThis.navigator?.vibrate?.(15);
    }, Math.max(0, dueMs - performance.now()));
  }

  /** Ends a press at rest, and pins its particle. Returns false if there is none. @param {PressTool & Tool} tool */
  pinPressed(tool) {
    const { particle } = tool;
    if (this.tool !== tool || particle === null || distance(tool.start, tool.pointer) > SLACK) return false;
    this.finish();
    // The release selects nothing.
    this.click = null;
    togglePin(this.app, particle);
    return true;
  }

  /** @param {PointerEvent} event */
  move(event) {
    const at = this.pixel(event);
    if (event.pointerType !== "touch") this.hover = at;
    this.isHoverStale = true;
    const before = this.pointers.get(event.pointerId);
    if (before === undefined) return;
    if (this.click !== null && distance(this.click, at) > CLICK_PIXELS) this.click = null;
    if (this.pointers.size === 2) this.pinch(event.pointerId, before, at);
    this.pointers.set(event.pointerId, at);
    this.tool?.move(at, event.timeStamp);
  }

  /** Zooms and pans with two fingers: the point between them stays between them. @param {number} id @param {Pixel} before @param {Pixel} at */
  pinch(id, before, at) {
    const { camera, renderer } = this.app;
    const other = [...this.pointers].find(([one]) => one !== id)?.[1];
    if (other === undefined) return;
    const middle = { x: (at.x + other.x) / 2, y: (at.y + other.y) / 2 };
    camera.zoom(clamp(distance(at, other) / Math.max(distance(before, other), 1), 0.5, 2), middle.x, middle.y, renderer.viewport);
    camera.pan((at.x - before.x) / 2, (at.y - before.y) / 2, renderer.viewport);
    renderer.isDirty = true;
  }

  /** @param {PointerEvent} event */
  release(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    clearTimeout(this.longPress);
    const { tool } = this;
    const heldMs = tool instanceof PressTool ? event.timeStamp - tool.pressedMs : 0;
    const click = event.type === "pointerup" && heldMs <= CLICK_MS ? this.click : null;
    this.click = null;
    // The timer of a busy page may not have come to it.
    if (event.type === "pointerup" && event.pointerType === "touch" && tool instanceof PressTool && heldMs >= LONG_PRESS_MS && this.pinPressed(tool)) return;
    this.finish(event.timeStamp);
    if (click !== null) this.select(click, event);
  }

  /** Selects what was clicked, and nothing else unless Shift is held. @param {Pixel} at @param {PointerEvent} event */
  select(at, { pointerType, shiftKey }) {
    const { selection } = this.app;
    const isTouch = pointerType === "touch";
    const item = itemAt(this.app, at, isTouch ? REACH.touch : REACH.mouse, isTouch);
    if (item !== null && shiftKey) selection.toggle(item);
    else if (item !== null) selection.set([item]);
    else if (!shiftKey) selection.clear();
  }

  /** The particle that this page grabs, or null. */
  get grabbed() {
    return this.tool instanceof GrabTool && this.tool.isBegun ? this.tool.grabbed : null;
  }

  /** The node has refused the grab: another client has the particle. */
  get isRefused() {
    return this.tool instanceof GrabTool && this.tool.isRefused;
  }

  /** Ends the tool in use; a grab releases its particle, and an object is put down or thrown. @param {number} ms time of the release */
  finish(ms = performance.now()) {
    this.tool?.end(ms);
    this.tool = null;
    this.app.renderer.isDirty = true;
  }

  /** Ends the tool without its last motion: the scene that it acted on is gone. */
  cancel() {
    this.tool?.cancel();
    this.abandon();
  }

  /** Drops the tool without a message: its connection is gone, which ends its grab. */
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
    const particle = this.canChange() ? particleAt(this.app, at, reach) : null;
    if (particle !== null) togglePin(this.app, particle);
    return particle !== null;
  }

  /** Toggles the pin of the particle that is dragged, of those that are selected, or of the one under the mouse. Returns false if there is none. */
  pinByKey() {
    const { app, tool } = this;
    const dragged = tool instanceof PressTool && tool.particle !== null ? [tool.particle] : [];
    const selected = app.selection.items.flatMap(({ kind, index }) => (kind === "particle" ? [index] : []));
    const chosen = dragged.length > 0 ? dragged : selected;
    if (chosen.length === 0 || !this.canChange()) return this.hover !== null && this.pinAt(this.hover, REACH.mouse);
    togglePins(app, chosen);
    return true;
  }

  /** @param {WheelEvent} event */
  turnWheel(event) {
    event.preventDefault();
    const { camera, renderer } = this.app;
    if (this.mode === "brush" && !event.ctrlKey) {
      this.brushRadius = clamp(this.brushRadius - this.notches.add(event) * BRUSH.step, BRUSH.min, BRUSH.max);
      if (this.tool instanceof BrushTool) this.tool.radius = this.brushRadius;
    } else {
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
      // Browsers report a pinch on a touchpad as a wheel with ctrl, in much smaller units.
      const units = clamp(event.deltaY * lines, -300, 300) * (event.ctrlKey ? 5 : 1);
      const at = this.pixel(event);
      camera.zoom(Math.exp(-units * ZOOM_PER_UNIT), at.x, at.y, renderer.viewport);
    }
    renderer.isDirty = true;
  }

  /** Lets the tool send its message, and updates the hovered particle, once per animation frame. @param {number} nowMs */
  tick(nowMs) {
    this.tool?.tick(nowMs);
    if (!this.isHoverStale || this.tool !== null) return;
    this.isHoverStale = false;
    const isQuick = (this.app.simulation.scene?.particleCount ?? 0) <= HOVER_PARTICLES_MAX;
    const canPick = this.hover !== null && isQuick && this.canChange() && (this.mode === "grab" || this.mode === "pin");
    const at = canPick ? this.hover : null;
    this.hovered = at === null ? null : particleAt(this.app, at, REACH.mouse);
    const isOver = this.hovered !== null || (at !== null && this.mode === "grab" && solidAt(this.app, at, HOVER_TRIANGLES_MAX) !== null);
    this.canvas.dataset.cursor = this.mode === "cut" ? "cut" : isOver ? "over" : this.mode;
  }
}

/** The tool that moves what is pressed: an anchor by its particle, a particle, or a solid if it hides the particle or no particle is near. Null otherwise.
 * @param {import("./tool.js").App} app @param {Pixel} at @param {number | null} particle @returns {CarryTool | GrabTool | null} */
function pressToolAt(app, at, particle) {
  const point = particle === null ? null : app.simulation.position(particle);
  const solid = solidAt(app, at);
  if (particle === null || (solid !== null && point !== null && isBehind(app.camera, point, solid.point))) {
    return solid === null ? null : new CarryTool(app, at, { object: "collider", particle: null, ...solid });
  }
  const anchor = anchorOf(app.simulation, particle);
  if (anchor === null || point === null) return new GrabTool(app, particle, at);
  return new CarryTool(app, at, { object: "anchor", index: anchor, point, particle });
}

/** True if a particle is hidden by the solid at a point, and does not just lie beside its edge.
 * @param {import("../geometry/camera.js").Camera} camera @param {import("../geometry/math.js").Vec3} particle @param {import("../geometry/math.js").Vec3} point */
function isBehind(camera, particle, point) {
  if (camera.isFlat) return false;
  const eye = camera.eye();
  return length(subtract(particle, eye)) > length(subtract(point, eye)) * (1 + BEHIND);
}

/** @param {Pixel} a @param {Pixel} b */
const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y);
