// Commands with an id, and who waits for their outcome.

/** @typedef {import("./messages.js").OutcomeMessage} Outcome */
/** @typedef {(outcome: Outcome) => void} OnOutcome */

/** Commands that may wait for their outcome; the oldest is forgotten beyond. */
const WAITING_MAX = 1024;

export class Commands {
  /** @param {(message: object) => boolean} send @param {(outcome: Outcome) => void} onRefused hears of every command that had no effect */
  constructor(send, onRefused) {
    this.send = send;
    this.onRefused = onRefused;
    this.lastId = 0;
    /** @type {Map<number, OnOutcome>} */
    this.waiting = new Map();
  }

  /** Sends a command, and later calls `onOutcome` with what became of it. False without a connection.
   * @param {string} type @param {object} [fields] @param {OnOutcome} [onOutcome] */
  run(type, fields = {}, onOutcome = () => {}) {
    this.lastId = (this.lastId + 1) % 2 ** 32;
    const isSent = this.send({ type, id: this.lastId, ...fields });
    if (isSent) this.waiting.set(this.lastId, onOutcome);
    if (this.waiting.size > WAITING_MAX) this.waiting.delete([...this.waiting.keys()][0]);
    return isSent;
  }

  /** For what is sent with every frame: only a refusal is answered. @param {string} type @param {object} fields */
  stream(type, fields) {
    return this.send({ type, ...fields });
  }

  /** @param {Outcome} outcome */
  receive(outcome) {
    const onOutcome = outcome.id === null ? undefined : this.waiting.get(outcome.id);
    if (outcome.id !== null) this.waiting.delete(outcome.id);
    onOutcome?.(outcome);
    if (outcome.status !== "applied") this.onRefused(outcome);
  }

  /** The connection is gone, and with it all answers. */
  forget() {
    this.waiting.clear();
  }
}
