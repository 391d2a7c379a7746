// What the page knows of the simulation: the last scene, the newest frame, what is torn and held.
// Messages go in, topics come out. It has no clock, no socket and no picture.

import { Emitter } from "./emitter.js";
import { lowestReach } from "./hanging.js";
import { Topology } from "./topology.js";
import { PIN } from "./wire.js";
import { axesOf } from "./camera.js";
import { add, boxOf, dot, length, scale, subtract } from "./math.js";

/** @typedef {import("./math.js").Vec3} Vec3 */
/** @typedef {import("./math.js").Box} Box */
/** @typedef {import("./wire.js").Message} Message */
/** @typedef {import("./wire.js").Scene} Scene */
/** @typedef {import("./wire.js").Frame} Frame */
/** @typedef {import("./wire.js").Stats} Stats */
/** @typedef {import("./wire.js").Collider} Collider */
/** @typedef {import("./messages.js").Hello} Hello */
/** @typedef {import("./messages.js").NodeState} NodeState */
/** @typedef {import("./messages.js").Parameters} Parameters */
/** @typedef {import("./messages.js").TimelineMessage} TimelineMessage */
/** @typedef {import("./messages.js").Playback} Playback */
/** @typedef {import("./messages.js").TextMessage} TextMessage */
/** A plane to stand on: normal · x = offset. @typedef {{ normal: Vec3, offset: number }} Plane */

/** Room under what hangs, in radii of the scene. */
const GROUND_GAP = 0.06;
/** A plane is a floor if its normal is that much upward. */
const FLOOR_COSINE = 0.99;

/**
 * @typedef {{
 *   scene: Scene, frame: Frame, tear: void, pins: void, colliders: Collider[], stats: Stats,
 *   hello: Hello, node: NodeState, parameters: Parameters, timeline: TimelineMessage | null, playback: Playback | null,
 *   outcome: import("./messages.js").OutcomeMessage, reset: void, clients: number,
 *   notice: { level: string, text: string }, ground: void,
 * }} Topics
 */

/** @extends {Emitter<Topics>} */
export class Simulation extends Emitter {
  constructor() {
    super();
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {Topology | null} */
    this.topology = null;
    /** @type {Frame | null} */
    this.frame = null;
    /** Number of the newest frame that came, shown or not: one that a scene has overtaken has to be
     * acknowledged too, or its credit is lost. @type {number | null} */
    this.frameNumber = null;
    /** Constraints in the order of tearing. @type {number[]} */
    this.torn = [];
    /** Flags of the particles that are not free, as the bridge said last. @type {Map<number, number>} */
    this.pinsReceived = new Map();
    /** The same with what is expected of the node. @type {Map<number, number>} */
    this.pins = new Map();
    /** @type {Collider[]} */
    this.colliders = [];
    /** @type {ArrayLike<number>} */
    this.nonFinite = [];
    /** @type {Stats | null} */
    this.stats = null;
    /** @type {Hello | null} */
    this.hello = null;
    /** @type {NodeState | null} */
    this.node = null;
    /** @type {Parameters | null} */
    this.parameters = null;
    /** @type {TimelineMessage | null} */
    this.timeline = null;
    /** @type {Playback | null} */
    this.playback = null;
    this.clients = 0;
    /** @type {Plane | null} */
    this.ground = null;
    this.groundIsSettled = false;
  }

  get isReplay() {
    return this.hello?.mode === "replay";
  }

  get isPaused() {
    if (this.isReplay) return this.playback !== null && !this.playback.is_playing;
    return this.node?.is_paused ?? false;
  }

  /** A decoded binary message; one of another epoch than the scene's is not of this picture. @param {Message} message */
  receive(message) {
    if (message.kind === "stats") {
      this.stats = message;
      return this.emit("stats", message);
    }
    if (message.kind === "frame") this.frameNumber = message.number;
    if (message.kind === "scene") return this.receiveScene(message);
    if (this.scene === null || message.epoch !== this.scene.epoch) return;
    if (message.kind === "frame") this.receiveFrame(message);
    else if (message.kind === "tear") this.receiveTear(message);
    else if (message.kind === "pins") this.receivePins(message);
    else this.receiveColliders(message.colliders);
  }

  /** @param {Scene} scene */
  receiveScene(scene) {
    this.scene = scene;
    this.topology = new Topology(scene);
    this.frame = null;
    this.torn = [];
    this.pinsReceived = new Map();
    this.pins = new Map();
    this.colliders = [];
    this.nonFinite = [];
    this.ground = null;
    this.groundIsSettled = false;
    this.emit("scene", scene);
    this.emit("pins", undefined);
    this.emit("colliders", []);
  }

  /** @param {Frame} frame */
  receiveFrame(frame) {
    if (frame.particleCount !== this.scene?.particleCount) return;
    this.frame = frame;
    if (!sameNumbers(frame.nonFinite, this.nonFinite)) {
      this.nonFinite = frame.nonFinite.slice();
      this.rebuild();
    }
    this.emit("frame", frame);
  }

  /** @param {import("./wire.js").Tear} tear */
  receiveTear(tear) {
    const isMore = tear.first === this.torn.length;
    this.torn.length = Math.min(tear.first, this.torn.length);
    // One by one: as arguments of a call, a long list is more than the stack takes.
    for (const constraint of tear.constraints) this.torn.push(constraint);
    if (!isMore) return this.rebuild();
    this.topology?.remove(tear.constraints);
    this.emit("tear", undefined);
  }

  /** Works out anew what is whole: after a reset, or when particles lost their position. */
  rebuild() {
    this.topology?.restore();
    this.topology?.remove(this.torn);
    this.topology?.removeAround(Uint32Array.from(this.nonFinite));
    this.emit("tear", undefined);
  }

  /** @param {import("./wire.js").Pins} pins */
  receivePins(pins) {
    this.pinsReceived = new Map();
    pins.particles.forEach((particle, k) => this.pinsReceived.set(particle, pins.flags[k]));
    this.pins = new Map(this.pinsReceived);
    this.emit("pins", undefined);
    if (!this.groundIsSettled) this.settleGround();
  }

  /** @param {Collider[]} colliders */
  receiveColliders(colliders) {
    const hadFloor = this.colliders.length > 0;
    this.colliders = colliders;
    this.emit("colliders", colliders);
    if (!hadFloor) this.settleGround();
  }

  /** The floor: a collider's where there is one; else a little below what can hang lowest; else none. */
  settleGround() {
    if (this.scene === null || this.scene.isPlanar) return;
    const { up } = this.axes();
    this.ground = this.floor();
    if (this.ground === null) {
      const lowest = lowestReach(this.scene, [...this.pins.keys()], up);
      this.ground = lowest === null ? null : { normal: up, offset: lowest - this.radius() * GROUND_GAP };
    }
    this.groundIsSettled = true;
    this.emit("ground", undefined);
  }

  /** The highest floor among the colliders. @returns {Plane | null} */
  floor() {
    const { up } = this.axes();
    /** @type {Plane[]} */
    const floors = this.colliders.flatMap((one) => floorOf(one, up));
    return floors.length === 0 ? null : floors.reduce((best, one) => (one.offset > best.offset ? one : best));
  }

  axes() {
    return axesOf(this.scene?.up ?? "y", this.scene?.isPlanar ? 2 : 3);
  }

  /** Half the diagonal of the box round the scene's positions. */
  radius() {
    if (this.scene === null || this.scene.particleCount === 0) return 1;
    return Math.max(length(subtract(this.scene.max, this.scene.min)) / 2, 1e-3);
  }

  /** The middle of the box round the scene's positions. @returns {Vec3} */
  middle() {
    return this.scene === null ? [0, 0, 0] : scale(add(this.scene.min, this.scene.max), 0.5);
  }

  /** Shows at once what the node has answered but will publish with its next step only: while it is
   * paused, that may be long. @param {number} particle @param {boolean} isPinned */
  expectPin(particle, isPinned) {
    const others = (this.pins.get(particle) ?? 0) & ~PIN.pinned;
    if (isPinned) this.pins.set(particle, others | PIN.pinned);
    else if (others !== 0) this.pins.set(particle, others);
    else this.pins.delete(particle);
    this.emit("pins", undefined);
  }

  /** The same for a cut, which is not in the list of what is torn before the bridge says so. @param {number} epoch @param {number[]} constraints */
  expectCut(epoch, constraints) {
    if (epoch !== this.scene?.epoch) return;
    this.topology?.remove(constraints);
    this.emit("tear", undefined);
  }

  /** A bridge of another mode may have come to the address of the one before. @param {Hello} hello */
  receiveHello(hello) {
    this.hello = hello;
    if (hello.mode === "live") {
      this.timeline = null;
      this.playback = null;
      this.emit("timeline", null);
      this.emit("playback", null);
    }
    this.emit("hello", hello);
  }

  /** Takes back what was expected and not yet said: a reset may undo it before the bridge has sent it,
   * which then has nothing to correct. */
  receiveReset() {
    this.pins = new Map(this.pinsReceived);
    this.emit("pins", undefined);
    this.rebuild();
    this.emit("reset", undefined);
  }

  /** @param {number} particle @returns {Vec3 | null} */
  position(particle) {
    const { frame } = this;
    if (frame === null || particle >= frame.particleCount || particle < 0) return null;
    const { lo, scale: unit, positions: p } = frame;
    const i = 3 * particle;
    return [lo[0] + unit[0] * p[i], lo[1] + unit[1] * p[i + 1], lo[2] + unit[2] * p[i + 2]];
  }

  /** The box round the newest positions. @returns {Box} */
  box() {
    const { frame, scene } = this;
    if (frame === null) return scene === null ? boxOf([]) : boxOf(scene.positions);
    const raw = boxOf(frame.positions);
    const at = (/** @type {Vec3} */ value) => /** @type {Vec3} */ ([0, 1, 2].map((axis) => frame.lo[axis] + frame.scale[axis] * value[axis]));
    return frame.particleCount === 0 ? raw : { min: at(raw.min), max: at(raw.max) };
  }

  /** @param {TextMessage} message */
  receiveText(message) {
    switch (message.type) {
      case "hello": return this.receiveHello(message);
      case "node": this.node = message; return this.emit("node", message);
      case "parameters": this.parameters = message; return this.emit("parameters", message);
      case "timeline": this.timeline = message; return this.emit("timeline", message);
      case "playback": this.playback = message; return this.emit("playback", message);
      case "clients": this.clients = message.count; return this.emit("clients", message.count);
      case "outcome": return this.emit("outcome", message);
      case "reset": return this.receiveReset();
      case "notice": return this.emit("notice", message);
      default: // A later bridge may say more.
    }
  }
}

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
function sameNumbers(a, b) {
  if (a.length !== b.length) return false;
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

/** @param {Collider} one @param {Vec3} up @returns {Plane[]} */
function floorOf(one, up) {
  if (one.shape === "plane" && dot(one.normal, up) > FLOOR_COSINE) return [{ normal: one.normal, offset: one.offset }];
  if (one.shape === "bounds") return [{ normal: up, offset: Math.min(dot(one.a, up), dot(one.b, up)) }];
  return [];
}
