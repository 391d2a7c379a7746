// The view of a scene that settles: cloth that has fallen on a floor is lower and smaller than at the beginning. Some
// seconds after a load the view glides to what the scene has become, unless the user has a view of their own.

import { add, length, sameNumbers, scale, subtract } from "../geometry/math.js";
import { PIN } from "../net/wire.js";
import { fittedBox } from "../state/framing.js";

/** @typedef {import("../geometry/math.js").Box} Box */
/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** Target and distance of the camera. @typedef {{ target: Vec3, distance: number }} Framing */

/** Ages of a scene at which the view follows, how long it is watched before, and how often, in simulated s. */
const AGES_S = [4, 10];
const WATCH_S = 2;
const SAMPLE_S = 0.1;
/** A scene that sweeps through a box this much larger than its own has not settled. */
const SWEEP_MAX = 1.15;
/** Change of the distance, and of the target in distances, from which a settled scene is worth a motion. */
const SHRINKING = 0.9;
const SHIFT_MIN = 0.1;
/** Growth of the distance from which a scene has left the picture, and to which it is followed: not where it flies away. */
const GROWTH = { min: 1.15, max: 2.5 };
const GLIDE_MS = 900;

/** The space that a scene takes while it is watched. */
export class Watch {
  constructor() {
    /** @type {Box | null} */
    this.union = null;
    /** @type {Box | null} */
    this.last = null;
    this.sampledS = -Infinity;
  }

  /** @param {Box} box @param {number} timeS */
  add(box, timeS) {
    const { union } = this;
    this.last = box;
    this.sampledS = timeS;
    this.union = union === null ? box : {
      min: /** @type {Vec3} */ (box.min.map((one, axis) => Math.min(one, union.min[axis]))),
      max: /** @type {Vec3} */ (box.max.map((one, axis) => Math.max(one, union.max[axis]))),
    };
  }

  /** True if the scene has stayed about where it is. */
  get isSettled() {
    const { union, last } = this;
    return union !== null && last !== null && length(subtract(union.max, union.min)) <= SWEEP_MAX * length(subtract(last.max, last.min));
  }
}

/** True if the view should change: a settled scene is smaller or elsewhere, or any scene has left the picture.
 * @param {Framing} now @param {Framing} fitted @param {boolean} isSettled */
export function isWorthwhile(now, fitted, isSettled) {
  const growth = fitted.distance / now.distance;
  if (growth > GROWTH.min) return growth < GROWTH.max;
  const shift = length(subtract(fitted.target, now.target)) / now.distance;
  return isSettled && (growth < SHRINKING || shift > SHIFT_MIN);
}

/** The framing between two others: slow at both ends. @param {Framing} from @param {Framing} to @param {number} share 0..=1 @returns {Framing} */
export function between(from, to, share) {
  const eased = share * share * (3 - 2 * share);
  return {
    target: add(from.target, scale(subtract(to.target, from.target), eased)),
    distance: from.distance * (to.distance / from.distance) ** eased,
  };
}

export class Settling {
  /** @param {import("../tools/tool.js").App} app @param {{ touches: number }} input counts what the user does to the scene */
  constructor(app, input) {
    this.app = app;
    this.input = input;
    this.watch = new Watch();
    /** Simulated time of the first picture; null if the view does not follow the scene. @type {number | null} */
    this.beginS = null;
    this.nextAge = 0;
    this.touches = 0;
    /** The framing that the page has set; any other one is the user's. @type {Framing} */
    this.own = this.framing();
    /** @type {{ from: Framing, to: Framing, startMs: number | null } | null} */
    this.glide = null;
  }

  /** @returns {Framing} */
  framing() {
    const { target, distance } = this.app.camera;
    return { target: [...target], distance };
  }

  /** True if the page has set the framing, not the user. */
  isOwn() {
    const { target, distance } = this.app.camera;
    return distance === this.own.distance && sameNumbers(target, this.own.target);
  }

  /** Notes the framing of the page. A watched scene will have others. @param {boolean} isWatched */
  begin(isWatched) {
    const { simulation } = this.app;
    const isCarried = [...simulation.pins.values()].some((flags) => (flags & PIN.anchored) !== 0);
    this.beginS = isWatched && !simulation.isReplay && !isCarried ? simulation.frame?.simTime ?? null : null;
    this.nextAge = 0;
    this.watch = new Watch();
    this.touches = this.input.touches;
    this.own = this.framing();
    this.glide = null;
  }

  /** Watches a new state of the scene. */
  follow() {
    const { simulation } = this.app;
    const { frame } = simulation;
    if (frame === null || this.beginS === null || simulation.isLookingBack) return;
    if (this.nextAge >= AGES_S.length || this.touches !== this.input.touches || !(this.glide !== null || this.isOwn())) {
      this.beginS = null;
      return;
    }
    const age = frame.simTime - this.beginS;
    if (age < AGES_S[this.nextAge] - WATCH_S || frame.simTime < this.watch.sampledS + SAMPLE_S) return;
    this.watch.add(fittedBox(simulation), frame.simTime);
    if (age < AGES_S[this.nextAge] ) return;
    this.nextAge += 1;
    this.settle(this.watch);
    this.watch = new Watch();
  }

  /** Begins to glide to what was watched, if that is worth it. @param {Watch} watch */
  settle({ union, isSettled }) {
    const { camera, renderer } = this.app;
    if (union === null) return;
    const from = this.framing();
    const { width, height } = renderer.viewport;
    camera.frame(union, width / height);
    const to = this.framing();
    Object.assign(camera, from);
    if (isWorthwhile(from, to, isSettled)) this.glide = { from, to, startMs: null };
  }

  /** Moves the view on. @param {number} nowMs */
  tick(nowMs) {
    const { glide, app: { camera, renderer } } = this;
    if (glide === null) return;
    if (!this.isOwn()) {
      this.glide = null;
      return;
    }
    glide.startMs ??= nowMs;
    const share = matchMedia("(prefers-reduced-motion: reduce)").matches ? 1 : Math.min(1, (nowMs - glide.startMs) / GLIDE_MS);
    Object.assign(camera, between(glide.from, glide.to, share));
    this.own = this.framing();
    if (share === 1) this.glide = null;
    renderer.isDirty = true;
  }
}
