// The state of the simulation as the page knows it: the last scene, the newest frame, torn constraints
// and pins. Messages go in, events come out. It uses no clock, no socket and no picture.

import { Emitter } from "./emitter.js";
import { lowestReach } from "./hanging.js";
import { LiveState, flagsOf, updateTorn } from "./live-state.js";
import { Topology } from "./topology.js";
import { PIN } from "../net/wire.js";
import { sceneAxes } from "../geometry/camera.js";
import { add, boxOf, dot, length, sameNumbers, scale, subtract } from "../geometry/math.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/math.js").Box} Box */
/** @typedef {import("../net/wire.js").Message} Message */
/** @typedef {import("../net/wire.js").Scene} Scene */
/** @typedef {import("../net/wire.js").Frame} Frame */
/** @typedef {import("../net/wire.js").Stats} Stats */
/** @typedef {import("../net/wire.js").Collider} Collider */
/** @typedef {import("../net/wire.js").Forces} Forces */
/** @typedef {import("../net/wire.js").Speeds} Speeds */
/** @typedef {import("../net/wire.js").Inspected} Inspected */
/** @typedef {import("../net/messages.js").Hello} Hello */
/** @typedef {import("../net/messages.js").NodeState} NodeState */
/** @typedef {import("../net/messages.js").Parameters} Parameters */
/** @typedef {import("../net/messages.js").TimelineMessage} TimelineMessage */
/** @typedef {import("../net/messages.js").Playback} Playback */
/** @typedef {import("../net/messages.js").HistoryMessage} HistoryMessage */
/** @typedef {import("../net/messages.js").RecordingMessage} RecordingMessage */
/** @typedef {import("../net/messages.js").TextMessage} TextMessage */
/** A floor: normal · x = offset. @typedef {{ normal: Vec3, offset: number }} Plane */

/** Least cosine between the normal of a floor and the up axis. */
const FLOOR_COSINE = 0.99;

/**
 * @typedef {{
 *   scene: Scene, frame: Frame, tear: void, pins: void, colliders: Collider[], stats: Stats,
 *   hello: Hello, node: NodeState, parameters: Parameters, timeline: TimelineMessage | null, playback: Playback | null,
 *   ghost: import("../net/messages.js").GhostMessage,
 *   outcome: import("../net/messages.js").OutcomeMessage, reset: number,
 *   notice: { level: string, text: string }, ground: void, connection: boolean,
 *   history: HistoryMessage | null, undoable: void, recording: RecordingMessage, past: number | null, present: Frame,
 * }} Topics
 */

/** @extends {Emitter<Topics>} */
export class Simulation extends Emitter {
  constructor() {
    super();
    /** @type {Scene | null} */
    this.scene = null;
    /** The sphere around the bounding box of the scene's positions: each picture asks for it several times. */
    this.extent = { radius: 1, middle: /** @type {Vec3} */ ([0, 0, 0]) };
    /** @type {Topology | null} */
    this.topology = null;
    /** @type {Frame | null} */
    this.frame = null;
    /** Number of the newest frame received, shown or not. A frame that a new scene overtook must be
     * acknowledged too, or its credit is lost. @type {number | null} */
    this.frameNumber = null;
    /** Torn constraints, in the order of tearing. @type {number[]} */
    this.torn = [];
    /** Their causes. @type {number[]} */
    this.tornCauses = [];
    /** Flags of the particles that are not free, as last received. @type {Map<number, number>} */
    this.pinsReceived = new Map();
    /** The same, with expected changes that the node has yet to publish. @type {Map<number, number>} */
    this.pins = new Map();
    /** @type {Collider[]} */
    this.colliders = [];
    /** The forces of the frame, if the page has asked for them. @type {Forces | null} */
    this.forces = null;
    /** The speeds of the frame, if the page has asked for them. @type {Speeds | null} */
    this.speeds = null;
    /** The exact states of particles in the frame, if the page has asked for any. @type {Inspected | null} */
    this.inspected = null;
    /** The newest messages that belong to a frame, by kind: it follows. @type {{ forces: Forces | null, speeds: Speeds | null, inspected: Inspected | null }} */
    this.awaiting = { forces: null, speeds: null, inspected: null };
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
    /** The state of another recording beside the frame, if there is one. @type {import("../net/wire.js").Ghost | null} */
    this.ghost = null;
    /** The next ghost: its frame follows. @type {import("../net/wire.js").Ghost | null} */
    this.nextGhost = null;
    /** The choice of the other recording, and how it compares. @type {import("../net/messages.js").GhostMessage | null} */
    this.ghostChoice = null;
    /** The past of a live simulation that the page can look back at. @type {HistoryMessage | null} */
    this.history = null;
    /** The recording that the bridge makes, or the last one. @type {RecordingMessage | null} */
    this.recording = null;
    /** The newest change of this page that it can undo. @type {import("../net/messages.js").Undoable | null} */
    this.undoable = null;
    /** The present, while the page looks at an earlier state. Everything else is that state then. @type {LiveState | null} */
    this.live = null;
    /** Number of the next messages that show an earlier state, and whether they belong to the scene. */
    this.announced = { count: 0, isShown: false };
    /** Cuts that the node has yet to publish, since the last frame. @type {number[]} */
    this.expectedCuts = [];
    /** The floor of the scene, which is drawn because it holds. @type {Plane | null} */
    this.ground = null;
    /** The lowest height that the scene can hang to; null if it falls. @type {number | null} */
    this.lowest = null;
    this.groundIsSettled = false;
    /** The bridge has accepted the page, and the connection is open. */
    this.isConnected = false;
  }

  /** @param {boolean} isConnected */
  setConnected(isConnected) {
    if (isConnected === this.isConnected) return;
    this.isConnected = isConnected;
    this.emit("connection", isConnected);
  }

  /** True if the picture is of the present: the bridge answers, and its node or recording is there. */
  get isAlive() {
    return this.isConnected && (this.isReplay || this.node?.state === "alive");
  }

  /** True if the picture is of a recording, which cannot be changed. */
  get isRecording() {
    return this.isReplay || (this.node?.is_replay ?? false);
  }

  get isReplay() {
    return this.hello?.mode === "replay";
  }

  get isPaused() {
    if (this.isReplay) return this.playback !== null && !this.playback.is_playing;
    return this.node?.is_paused ?? false;
  }

  /** Applies a binary message; drops one whose epoch is not that of the scene. @param {Message} message */
  receive(message) {
    if (this.announced.count > 0) {
      this.announced.count--;
      if (this.announced.isShown) this.show(message);
      return;
    }
    if (message.kind === "past") return this.beginPast(message);
    if (message.kind === "stats") {
      this.stats = message;
      return this.emit("stats", message);
    }
    if (message.kind === "frame") this.frameNumber = message.number;
    if (message.kind === "scene") return this.receiveScene(message);
    if (this.scene === null || message.epoch !== this.scene.epoch) return;
    if (message.kind === "frame" && message.step !== this.present?.step) this.expectedCuts = [];
    if (this.live === null) return this.show(message);
    this.live.receive(message);
    if (message.kind !== "frame") return;
    if (this.live.isDue) this.returnToPresent();
    else this.emit("present", message);
  }

  /** Shows a message: of the present, or of the state that the page looks back at. @param {Message} message */
  show(message) {
    if (message.kind === "frame") this.receiveFrame(message);
    else if (message.kind === "tear") this.receiveTear(message);
    else if (message.kind === "pins") this.receivePins(message);
    else if (message.kind === "forces") this.awaiting.forces = message;
    else if (message.kind === "speeds") this.awaiting.speeds = message;
    else if (message.kind === "inspected") this.awaiting.inspected = message;
    else if (message.kind === "ghost") this.nextGhost = message;
    else if (message.kind === "colliders") this.receiveColliders(message.colliders);
  }

  /** Begins to show an earlier state: the next messages are its parts. @param {import("../net/wire.js").Past} past */
  beginPast({ epoch, step, count }) {
    const { frame } = this;
    const isShown = frame !== null && epoch === this.scene?.epoch && this.live?.returnStep == null;
    this.announced = { count, isShown };
    if (!isShown) return;
    this.live ??= new LiveState(this, frame);
    this.emit("past", step);
  }

  /** The page shows an earlier state, and the simulation goes on. */
  get isLookingBack() {
    return this.live !== null;
  }

  /** The newest frame, on show or not. */
  get present() {
    return this.live?.frame ?? this.frame;
  }

  /** Shows the present again. */
  returnToPresent() {
    const { live } = this;
    if (live === null) return;
    this.live = null;
    [this.torn, this.tornCauses] = [live.torn, live.tornCauses];
    [this.pinsReceived, this.pins] = [live.pinsReceived, live.pins];
    this.emit("pins", undefined);
    this.receiveColliders(live.colliders);
    this.awaiting = live.awaiting;
    this.receiveFrame(live.frame);
    this.rebuild();
    this.emit("past", null);
  }

  /** Returns to the present with the step that shows a rewind. @param {number} step */
  returnAt(step) {
    if (this.live === null) return;
    this.live.returnStep = step;
    if (this.live.isDue) this.returnToPresent();
  }

  /** @param {Scene} scene */
  receiveScene(scene) {
    const wasLookingBack = this.isLookingBack;
    this.live = null;
    this.announced = { count: 0, isShown: false };
    this.expectedCuts = [];
    this.scene = scene;
    this.extent = extentOf(scene);
    this.topology = new Topology(scene);
    this.frame = null;
    this.torn = [];
    this.tornCauses = [];
    this.pinsReceived = new Map();
    this.pins = new Map();
    this.colliders = [];
    this.forces = this.speeds = this.inspected = null;
    this.ghost = this.nextGhost = null;
    this.awaiting = { forces: null, speeds: null, inspected: null };
    this.nonFinite = [];
    this.ground = null;
    this.lowest = null;
    this.groundIsSettled = false;
    this.emit("scene", scene);
    this.emit("pins", undefined);
    this.emit("colliders", []);
    if (wasLookingBack) this.emit("past", null);
  }

  /** @param {Frame} frame */
  receiveFrame(frame) {
    if (frame.particleCount !== this.scene?.particleCount) return;
    this.frame = frame;
    const { forces, speeds, inspected } = this.awaiting;
    this.forces = forces?.step === frame.step ? forces : null;
    this.speeds = speeds?.step === frame.step ? speeds : null;
    this.inspected = inspected?.step === frame.step ? inspected : null;
    [this.ghost, this.nextGhost] = [this.nextGhost, null];
    if (!sameNumbers(frame.nonFinite, this.nonFinite)) {
      this.nonFinite = frame.nonFinite.slice();
      this.rebuild();
    }
    this.emit("frame", frame);
  }

  /** @param {import("../net/wire.js").Tear} tear */
  receiveTear(tear) {
    const isAppended = tear.first === this.torn.length;
    updateTorn(this, tear);
    if (!isAppended) return this.rebuild();
    this.topology?.remove(tear.constraints);
    this.emit("tear", undefined);
  }

  /** Recomputes which constraints and triangles are intact: after a reset, or when particles become non-finite. */
  rebuild() {
    this.topology?.restore();
    this.topology?.remove(this.torn);
    if (!this.isLookingBack) this.topology?.remove(this.expectedCuts);
    this.topology?.removeAround(Uint32Array.from(this.nonFinite));
    this.emit("tear", undefined);
  }

  /** @param {import("../net/wire.js").Pins} pins */
  receivePins(pins) {
    this.pinsReceived = flagsOf(pins);
    this.pins = new Map(this.pinsReceived);
    this.emit("pins", undefined);
    if (!this.groundIsSettled) this.settleGround();
  }

  /** @param {Collider[]} colliders */
  receiveColliders(colliders) {
    const hadColliders = this.colliders.length > 0;
    this.colliders = colliders;
    this.emit("colliders", colliders);
    if (!hadColliders) this.settleGround();
  }

  /** Finds the floor among the colliders, and how far the scene can hang. */
  settleGround() {
    if (this.scene === null || this.scene.isPlanar) return;
    this.ground = this.floor();
    this.lowest = lowestReach(this.scene, [...this.pins.keys()], this.axes().up);
    this.groundIsSettled = true;
    this.emit("ground", undefined);
  }

  /** The highest floor among the colliders. @returns {Plane | null} */
  floor() {
    const { up } = this.axes();
    /** @type {Plane[]} */
    const floors = this.colliders.flatMap((one) => floorsOf(one, up));
    return floors.length === 0 ? null : floors.reduce((best, one) => (one.offset > best.offset ? one : best));
  }

  axes() {
    return sceneAxes(this.scene?.up ?? "y", this.scene?.isPlanar ? 2 : 3);
  }

  /** Half the diagonal of the bounding box of the scene's positions. */
  radius() {
    return this.extent.radius;
  }

  /** The center of the bounding box of the scene's positions. @returns {Readonly<Vec3>} */
  middle() {
    return this.extent.middle;
  }

  /** Shows an applied pin at once: a paused node publishes it only with its next step. @param {number} particle @param {boolean} isPinned */
  expectPin(particle, isPinned) {
    if (this.isLookingBack) return;
    const others = (this.pins.get(particle) ?? 0) & ~PIN.pinned;
    if (isPinned) this.pins.set(particle, others | PIN.pinned);
    else if (others !== 0) this.pins.set(particle, others);
    else this.pins.delete(particle);
    this.emit("pins", undefined);
  }

  /** Shows an applied cut at once; `torn` changes only when the bridge reports it. @param {number} epoch @param {number[]} constraints */
  expectCut(epoch, constraints) {
    if (epoch !== this.scene?.epoch) return;
    for (const constraint of constraints) this.expectedCuts.push(constraint);
    if (this.isLookingBack) return;
    this.topology?.remove(constraints);
    this.emit("tear", undefined);
  }

  /** Drops the recording if a live bridge now serves this address. @param {Hello} hello */
  receiveHello(hello) {
    this.hello = hello;
    this.history = null;
    this.undoable = null;
    this.emit("history", null);
    this.emit("undoable", undefined);
    this.ghostChoice = null;
    if (hello.mode === "live") {
      this.timeline = null;
      this.playback = null;
      this.emit("timeline", null);
      this.emit("playback", null);
    }
    this.emit("hello", hello);
  }

  /** Reverts expected pins and cuts. If the reset undid them before the bridge published them, no later
   * message corrects the page. */
  receiveReset(step = 0) {
    this.expectedCuts = [];
    // A reset of the present leaves an earlier state on show as it was.
    const present = this.live ?? this;
    present.pins = new Map(present.pinsReceived);
    if (!this.isLookingBack) {
      this.emit("pins", undefined);
      this.rebuild();
    }
    this.emit("reset", step);
  }

  /** @param {number} particle @returns {Vec3 | null} */
  position(particle) {
    const { frame } = this;
    if (frame === null || particle >= frame.particleCount || particle < 0) return null;
    const { lo, scale: unit, positions: p } = frame;
    const i = 3 * particle;
    return [lo[0] + unit[0] * p[i], lo[1] + unit[1] * p[i + 1], lo[2] + unit[2] * p[i + 2]];
  }

  /** The bounding box of the newest positions. @returns {Box} */
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
      case "undoable": this.undoable = message.what; return this.emit("undoable", undefined);
      case "recording": this.recording = message; return this.emit("recording", message);
      case "history": this.history = message; return this.emit("history", message);
      case "ghost": this.ghostChoice = message; return this.emit("ghost", message);
      case "playback": this.playback = message; return this.emit("playback", message);
      case "outcome": return this.emit("outcome", message);
      case "reset": return this.receiveReset(message.step);
      case "notice": return this.emit("notice", message);
      default: // The number of pages, which STATS has as well, or a message of a later bridge.
    }
  }
}

/** @param {Scene} scene */
function extentOf({ particleCount, min, max }) {
  return { radius: particleCount === 0 ? 1 : Math.max(length(subtract(max, min)) / 2, 1e-3), middle: scale(add(min, max), 0.5) };
}

/** @param {Collider} one @param {Vec3} up @returns {Plane[]} */
function floorsOf(one, up) {
  if (one.shape === "plane" && dot(one.normal, up) > FLOOR_COSINE) return [{ normal: one.normal, offset: one.offset }];
  if (one.shape === "bounds") return [{ normal: up, offset: Math.min(dot(one.a, up), dot(one.b, up)) }];
  return [];
}
