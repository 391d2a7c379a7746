// What a hand can do: hold a particle, brush many, cut along a stroke, pin. Each sends at most one
// message an animation frame, however often the pointer moves.

import { addScaled, clamp, length, scale, subtract } from "./math.js";
import { crossedSticks, particlesWithin, pickParticle, projectAll } from "./pick.js";
import { PIN } from "./wire.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** @typedef {import("./pick.js").Pixel} Pixel */
/** @typedef {{ simulation: import("./state.js").Simulation, camera: import("./camera.js").Camera, renderer: import("./gl/renderer.js").Renderer, commands: import("./commands.js").Commands }} Bench */
/** @typedef {{ start: Pixel, move(to: Pixel): void, tick(nowMs: number): void, end(): void, describe(): Trace }} Tool */
/** What the overlay draws of a tool. @typedef {{ line?: { particle: number, to: Pixel }, circle?: { at: Pixel, radius: number }, stroke?: Pixel[] }} Trace */

/** CSS pixels within which a particle is taken: a mouse, a finger. */
export const REACH = { mouse: 18, touch: 30 };
/** How far a brush pushes in a sixtieth of a second at most, in CSS pixels, as in the documents. */
const BRUSH_PIXELS_MAX = 20;
/** The least and most time that a motion is spread over, seconds. */
const OVER_S = { min: 1 / 240, max: 0.25 };
const BRUSH_OVER_S_MIN = 0.001;
/** The velocity of a hand is that of its last motions, within so many milliseconds: older is rest. */
const SWING_MS = 80;
/** Motions of a hand happen between two pictures at the least. */
const SWING_MS_MIN = 16;
/** Points of a stroke that stay drawn. */
const STROKE_POINTS_MAX = 60;

/** The particle at a pixel of the picture, of those that are drawn. @param {Bench} bench @param {Pixel} at @param {number} reach */
export function particleAt({ simulation, camera, renderer }, at, reach) {
  if (simulation.frame === null) return null;
  return pickParticle(simulation.frame, camera.viewProjection(renderer.viewport), renderer.viewport, at, reach);
}

/** Pins what is free, frees what is pinned. @param {Bench} bench @param {number} particle */
export function togglePin({ simulation, commands }, particle) {
  const isPinned = ((simulation.pins.get(particle) ?? 0) & PIN.pinned) !== 0;
  commands.run(isPinned ? "unpin" : "pin", { particle }, ({ status }) => {
    if (status === "applied" && simulation.isPaused) simulation.expectPin(particle, !isPinned);
  });
}

/** Holds one particle: it is driven to where the pointer meets the plane through it that faces the camera. @implements {Tool} */
export class Hand {
  /** @param {Bench} bench @param {number} particle @param {Pixel} start */
  constructor(bench, particle, start) {
    this.bench = bench;
    this.particle = particle;
    this.start = start;
    this.pointer = start;
    this.isMoved = false;
    this.sentMs = performance.now();
    /** Where the pointer was of late: the first is where it began, or was before the swing. */
    this.trail = [{ ms: this.sentMs, at: start }];
    this.anchor = /** @type {Vec3} */ (bench.simulation.position(particle));
    bench.commands.run("drag_begin", { particle, target: this.anchor });
  }

  /** @param {Pixel} to */
  move(to) {
    this.pointer = to;
    this.isMoved = true;
    const ms = performance.now();
    this.trail.push({ ms, at: to });
    while (this.trail.length > 1 && this.trail[1].ms < ms - SWING_MS) this.trail.shift();
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    if (!this.isMoved) return;
    const over_s = clamp((nowMs - this.sentMs) / 1000, OVER_S.min, OVER_S.max);
    this.bench.commands.stream("drag_move", { particle: this.particle, target: this.on(this.pointer), over_s });
    this.sentMs = nowMs;
    this.isMoved = false;
  }

  /** @param {Pixel} at @returns {Vec3} */
  on(at) {
    const { camera, renderer } = this.bench;
    return camera.onPlaneThrough(at.x, at.y, renderer.viewport, this.anchor);
  }

  /** Metres a second, of the last motions. @param {number} nowMs @returns {Vec3} */
  velocity(nowMs) {
    const last = this.trail[this.trail.length - 1];
    if (last.ms < nowMs - SWING_MS) return [0, 0, 0];
    const [first] = this.trail;
    const span = Math.max(last.ms - Math.max(first.ms, last.ms - SWING_MS), SWING_MS_MIN);
    return scale(subtract(this.on(last.at), this.on(first.at)), 1000 / span);
  }

  /** What is let go has the velocity of its last step. A motion that was sent may be over by then, or
   * not have begun: so the hand goes on as it went, and lets go when the node has taken that up. */
  end() {
    const { commands } = this.bench;
    const { particle } = this;
    const letGo = () => commands.run("drag_end", { particle });
    const velocity = this.velocity(performance.now());
    if (length(velocity) === 0) {
      this.tick(performance.now());
      letGo();
      return;
    }
    const target = addScaled(this.on(this.pointer), velocity, OVER_S.max);
    commands.run("drag_move", { particle, target, over_s: OVER_S.max }, letGo);
  }

  describe() {
    return { line: { particle: this.particle, to: this.pointer } };
  }
}

/** Pushes all particles in a circle along with the pointer. @implements {Tool} */
export class Brush {
  /** @param {Bench} bench @param {Pixel} start @param {number} radius CSS pixels */
  constructor(bench, start, radius) {
    this.bench = bench;
    this.start = start;
    this.before = start;
    this.pointer = start;
    this.radius = radius;
    this.sentMs = performance.now();
    this.depth = depthUnder(bench, start, radius) ?? bench.camera.target;
  }

  /** @param {Pixel} to */
  move(to) {
    this.pointer = to;
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    const { camera, renderer, commands } = this.bench;
    const { viewport } = renderer;
    if (this.pointer.x === this.before.x && this.pointer.y === this.before.y) {
      this.sentMs = nowMs;
      return;
    }
    const on = (/** @type {Pixel} */ at) => camera.onPlaneThrough(at.x, at.y, viewport, this.depth);
    const over_s = clamp((nowMs - this.sentMs) / 1000, BRUSH_OVER_S_MIN, OVER_S.max);
    const unit = camera.unitsPerPixel(this.depth, viewport);
    const { origin, direction } = camera.ray(this.before.x, this.before.y, viewport);
    commands.stream("brush", {
      eye: origin, ray: direction, radius: this.radius * unit, over_s,
      delta: subtract(on(this.pointer), on(this.before)), cap: BRUSH_PIXELS_MAX * unit * 60 * over_s,
    });
    this.before = this.pointer;
    this.sentMs = nowMs;
  }

  end() {}

  describe() {
    return { circle: { at: this.pointer, radius: this.radius } };
  }
}

/** Where the nearest particle in a circle is: the depth that a stroke moves at. @param {Bench} bench @param {Pixel} at @param {number} radius */
export function depthUnder({ simulation, camera, renderer }, at, radius) {
  if (simulation.frame === null) return null;
  const found = particlesWithin(simulation.frame, camera.viewProjection(renderer.viewport), renderer.viewport, at, radius);
  if (found.length === 0) return null;
  return simulation.position(found.reduce((best, one) => (one.w < best.w ? one : best)).particle);
}

/** Cuts every constraint that the blade under the pointer crosses, whichever of them moves. @implements {Tool} */
export class Knife {
  /** @param {Bench} bench @param {Pixel} start */
  constructor(bench, start) {
    this.bench = bench;
    this.start = start;
    /** @type {Pixel[]} */
    this.stroke = [start];
    /** The way since the last look, from where the blade stood then. @type {Pixel[]} */
    this.path = [start];
    /** What was seen at the last look. */
    this.seen = bench.simulation.frame;
    this.scene = bench.simulation.scene;
    /** Cut already, though the answer is not here yet. @type {Set<number>} */
    this.cut = new Set();
  }

  /** @param {Pixel} to */
  move(to) {
    this.path.push(to);
    this.stroke.push(to);
    if (this.stroke.length > STROKE_POINTS_MAX) this.stroke.shift();
  }

  tick() {
    const { simulation, camera, renderer, commands } = this.bench;
    const { frame, scene, topology } = simulation;
    if (frame === null || scene === null || topology === null) return;
    if (this.path.length === 1 && frame === this.seen) return;
    const past = scene === this.scene && this.seen !== null ? this.seen : frame;
    // Both by the camera of now: that it was turned meanwhile is no motion of the cloth.
    const [now, before] = [frame, past].map((one) => projectAll(one, camera.viewProjection(renderer.viewport), renderer.viewport));
    const crossed = crossedSticks(now, before, scene.ends, topology.isGone, this.path).filter((one) => !this.cut.has(one));
    this.path = this.path.slice(-1);
    [this.seen, this.scene] = [frame, scene];
    const most = simulation.hello?.limits.constraints_per_cut ?? 256;
    for (let first = 0; first < crossed.length; first += most) {
      const constraints = crossed.slice(first, first + most);
      const isSent = commands.run("cut", { epoch: scene.epoch, constraints }, ({ status }) => {
        if (status === "applied" && simulation.isPaused) simulation.expectCut(scene.epoch, constraints);
      });
      if (isSent) for (const one of constraints) this.cut.add(one);
    }
  }

  end() {
    this.tick();
  }

  describe() {
    return { stroke: this.stroke };
  }
}

/** Turns or moves the view. @implements {Tool} */
export class View {
  /** @param {Bench} bench @param {Pixel} start @param {"orbit" | "pan"} what */
  constructor(bench, start, what) {
    this.bench = bench;
    this.start = start;
    this.before = start;
    this.what = what;
  }

  /** @param {Pixel} to */
  move(to) {
    const { camera, renderer } = this.bench;
    const dx = to.x - this.before.x;
    const dy = to.y - this.before.y;
    if (this.what === "pan" || camera.isFlat) camera.pan(dx, dy, renderer.viewport);
    else camera.orbit(dx, dy);
    this.before = to;
    renderer.isDirty = true;
  }

  tick() {}

  end() {}

  describe() {
    return {};
  }
}
