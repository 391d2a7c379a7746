// The live state, kept while the page shows an earlier one.

/** @typedef {import("../net/wire.js").Message} Message */
/** @typedef {import("../net/wire.js").Frame} Frame */
/** @typedef {import("../net/wire.js").Collider} Collider */
/** @typedef {import("../net/wire.js").Forces} Forces */

/** Appends to a list of torn constraints, or replaces its end. @param {number[]} torn @param {import("../net/wire.js").Tear} tear */
export function updateTorn(torn, tear) {
  torn.length = Math.min(tear.first, torn.length);
  // One by one: spreading a long list as arguments overflows the stack.
  for (const constraint of tear.constraints) torn.push(constraint);
}

/** Flags by particle. @param {import("../net/wire.js").Pins} pins @returns {Map<number, number>} */
export function flagsOf(pins) {
  const flags = new Map();
  pins.particles.forEach((particle, k) => flags.set(particle, pins.flags[k]));
  return flags;
}

export class LiveState {
  /** @param {{ torn: number[], pinsReceived: Map<number, number>, pins: Map<number, number>, colliders: Collider[], forces: Forces | null }} shown @param {Frame} frame */
  constructor({ torn, pinsReceived, pins, colliders, forces }, frame) {
    this.frame = frame;
    this.torn = [...torn];
    this.pinsReceived = pinsReceived;
    this.pins = pins;
    this.colliders = colliders;
    this.forces = forces;
    /** The page returns to the present once this step arrives: the first one after a rewind. @type {number | null} */
    this.returnStep = null;
  }

  /** Applies a message of the present. @param {Message} message */
  receive(message) {
    if (message.kind === "frame") this.frame = message;
    else if (message.kind === "tear") updateTorn(this.torn, message);
    else if (message.kind === "pins") this.pins = this.pinsReceived = flagsOf(message);
    else if (message.kind === "forces") this.forces = message;
    else if (message.kind === "colliders") this.colliders = message.colliders;
  }

  /** True if the page waits for a step that has arrived. */
  get isDue() {
    return this.returnStep !== null && this.frame.step >= this.returnStep;
  }
}
