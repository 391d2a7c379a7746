// Sends commands, and routes their outcomes to the callers by id.

/** @typedef {import("./messages.js").OutcomeMessage} Outcome */
/** Returns true if it has told the user of a refusal. @typedef {(outcome: Outcome) => boolean | void} OnOutcome */

/** Limit on commands without an outcome yet; the oldest callback is dropped beyond it. */
const WAITING_MAX = 1024;

export class Commands {
  /** @param {(message: object) => boolean} send @param {(outcome: Outcome) => void} onRefused receives the outcome of a command that was not applied, unless its caller has told the user */
  constructor(send, onRefused) {
    this.send = send;
    this.onRefused = onRefused;
    this.lastId = 0;
    /** @type {Map<number, OnOutcome>} */
    this.waiting = new Map();
  }

  /** Sends a command, and later calls `onOutcome` with its outcome. Returns false without a connection.
   * @param {string} kind @param {object} [fields] @param {OnOutcome} [onOutcome] */
  run(kind, fields = {}, onOutcome = () => {}) {
    this.lastId = (this.lastId + 1) % 2 ** 32;
    const isSent = this.send({ kind, id: this.lastId, ...fields });
    if (isSent) this.waiting.set(this.lastId, onOutcome);
    if (this.waiting.size > WAITING_MAX) this.waiting.delete([...this.waiting.keys()][0]);
    return isSent;
  }

  /** Sends a command without an id, for those sent once per frame: the bridge answers only a refusal. @param {string} kind @param {object} fields */
  stream(kind, fields) {
    return this.send({ kind, ...fields });
  }

  /** @param {Outcome} outcome */
  receive(outcome) {
    const onOutcome = outcome.id === null ? undefined : this.waiting.get(outcome.id);
    if (outcome.id !== null) this.waiting.delete(outcome.id);
    const isTold = onOutcome?.(outcome) === true;
    if (outcome.status !== "applied" && !isTold) this.onRefused(outcome);
  }

  /** Drops all callbacks: a lost connection brings no more outcomes. */
  clear() {
    this.waiting.clear();
  }
}
