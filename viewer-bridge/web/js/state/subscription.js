// What the page asks the bridge for besides the positions. Each costs the node or the network something, so
// the page asks only while it shows it.

/** @typedef {{ forces(): boolean, speeds(): boolean, inspected(): number[] }} Wanted */

export class Subscription {
  /** @param {import("./simulation.js").Simulation} simulation @param {import("../net/commands.js").Commands} commands @param {Wanted} wanted */
  constructor(simulation, commands, wanted) {
    this.simulation = simulation;
    this.commands = commands;
    this.wanted = wanted;
    this.forces = false;
    this.speeds = false;
    /** @type {number[]} */
    this.inspected = [];
    simulation.on("connection", () => this.forget());
  }

  /** A new connection has no subscription yet. */
  forget() {
    this.forces = false;
    this.speeds = false;
    this.inspected = [];
  }

  /** Sends what has changed, once per animation frame. */
  tick() {
    if (!this.simulation.isConnected) return;
    const { commands, wanted } = this;
    const forces = wanted.forces();
    const speeds = wanted.speeds();
    const inspected = wanted.inspected();
    if (forces !== this.forces && commands.send({ type: "forces", is_on: forces })) this.forces = forces;
    if (speeds !== this.speeds && commands.send({ type: "speeds", is_on: speeds })) this.speeds = speeds;
    if (!isSame(inspected, this.inspected) && commands.send({ type: "inspect", particles: inspected })) this.inspected = inspected;
  }
}

/** @param {number[]} a @param {number[]} b */
const isSame = (a, b) => a === b || (a.length === b.length && a.every((one, k) => one === b[k]));
