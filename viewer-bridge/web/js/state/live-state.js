// The live state, kept while the page shows an earlier one.

/** @typedef {import("../net/wire.js").Message} Message */
/** @typedef {import("../net/wire.js").Frame} Frame */
/** @typedef {import("../net/wire.js").Collider} Collider */

/** Messages that belong to the frame behind them, by kind: the newest of each.
 * @typedef {{ forces: import("../net/wire.js").Forces | null, speeds: import("../net/wire.js").Speeds | null, inspected: import("../net/wire.js").Inspected | null }} Awaiting */

/** Appends to the torn constraints and their causes, or replaces their ends. @param {{ torn: number[], tornCauses: number[] }} lists @param {import("../net/wire.js").Tear} tear */
export function updateTorn({ torn, tornCauses }, tear) {
  torn.length = tornCauses.length = Math.min(tear.first, torn.length);
  // One by one: spreading a long list as arguments overflows the stack.
  for (const constraint of tear.constraints) torn.push(constraint);
  for (const cause of tear.causes) tornCauses.push(cause);
}

/** Flags by particle. @param {import("../net/wire.js").Pins} pins @returns {Map<number, number>} */
export function flagsOf(pins) {
  const flags = new Map();
  pins.particles.forEach((particle, k) => flags.set(particle, pins.flags[k]));
  return flags;
}

export class LiveState {
  /** @param {{ torn: number[], tornCauses: number[], pinsReceived: Map<number, number>, pins: Map<number, number>, colliders: Collider[] } & Awaiting} shown @param {Frame} frame */
  constructor({ torn, tornCauses, pinsReceived, pins, colliders, forces, speeds, inspected }, frame) {
    this.frame = frame;
    this.torn = [...torn];
    this.tornCauses = [...tornCauses];
    this.pinsReceived = pinsReceived;
    this.pins = pins;
    this.colliders = colliders;
    /** @type {Awaiting} */
    this.awaiting = { forces, speeds, inspected };
    /** The page returns to the present once this step arrives: the first one after a rewind. @type {number | null} */
    this.returnStep = null;
  }

  /** Applies a message of the present. @param {Message} message */
  receive(message) {
    if (message.kind === "frame") this.frame = message;
    else if (message.kind === "tear") updateTorn(this, message);
    else if (message.kind === "pins") this.pins = this.pinsReceived = flagsOf(message);
    else if (message.kind === "forces") this.awaiting.forces = message;
    else if (message.kind === "speeds") this.awaiting.speeds = message;
    else if (message.kind === "inspected") this.awaiting.inspected = message;
    else if (message.kind === "colliders") this.colliders = message.colliders;
  }

  /** True if the page waits for a step that has arrived. */
  get isDue() {
    return this.returnStep !== null && this.frame.step >= this.returnStep;
  }
}
