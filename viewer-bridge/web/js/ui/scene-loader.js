// Loads scenes one at a time. Quick presses of a key ask for the next load before the last one is answered; a load
// can begin another run, in which the bridge no longer learns what became of the commands of the run before.

/** @typedef {import("../net/commands.js").Commands} Commands */

export class SceneLoader {
  /** @param {import("../state/simulation.js").Simulation} simulation @param {Commands} commands */
  constructor(simulation, commands) {
    this.commands = commands;
    /** The scene of the load without an answer. @type {string | null} */
    this.sent = null;
    /** The scene to load after it: only the newest one counts. @type {string | null} */
    this.next = null;
    /** The scene that will be on show, from its request until its arrival. @type {string | null} */
    this.requested = null;
    simulation.on("scene", ({ name }) => { if (name === this.requested || this.sent === null) this.requested = null; });
    simulation.on("connection", () => { this.sent = this.next = this.requested = null; });
  }

  /** @param {string} scene */
  load(scene) {
    this.requested = scene;
    if (this.sent === null) this.send(scene);
    else this.next = scene;
  }

  /** @param {string} scene */
  send(scene) {
    const isSent = this.commands.run("load", { scene }, ({ status }) => this.onAnswer(status === "applied"));
    if (isSent) this.sent = scene;
    else this.requested = null;
  }

  /** @param {boolean} isApplied */
  onAnswer(isApplied) {
    const { next, sent } = this;
    this.sent = this.next = null;
    if (next !== null && next !== sent) this.send(next);
    else if (!isApplied) this.requested = null;
  }
}
