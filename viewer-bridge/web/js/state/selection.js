// The selected particles and constraints. Indices survive frames and resets; another scene ends the selection.

import { Emitter } from "./emitter.js";

/** @typedef {{ kind: "particle" | "constraint", index: number }} Item */
/** @typedef {import("./simulation.js").Simulation} Simulation */

/** Limit on selected items: each has a colour of its own. */
export const SELECTED_MAX = 6;
/** Colours of the items, in the order of selection, in the picture, the panel and the plots. */
export const ITEM_COLORS = ["#00a3d7", "#d6409f", "#6a9f0b", "#a06bff", "#c98b00", "#e5484d"];

/** @param {Item} a @param {Item} b */
const isSame = (a, b) => a.kind === b.kind && a.index === b.index;

/** Short name of an item, as the user types it. @param {Item} item */
export const nameOf = ({ kind, index }) => (kind === "constraint" ? `c${index}` : String(index));

/** @extends {Emitter<{ change: void }>} */
export class Selection extends Emitter {
  /** @param {Simulation} simulation */
  constructor(simulation) {
    super();
    this.simulation = simulation;
    /** @type {Item[]} */
    this.items = [];
    /** The selected particles and the ends of the selected constraints. @type {number[]} */
    this.particles = [];
    /** The view moves along with the selection. */
    this.isFollowed = false;
    /** The scene that the items belong to. @type {string} */
    this.sceneKey = "";
    simulation.on("scene", ({ name, particleCount, constraintCount }) => {
      const key = `${name} ${particleCount} ${constraintCount}`;
      // The same scene in a new run has the same particles.
      if (key !== this.sceneKey && this.items.length > 0) this.set([]);
      this.sceneKey = key;
    });
  }

  /** @param {Item[]} items */
  set(items) {
    this.items = items.slice(-SELECTED_MAX);
    const ends = this.simulation.scene?.ends ?? [];
    this.particles = [...new Set(this.items.flatMap(({ kind, index }) => (kind === "particle" ? [index] : [ends[2 * index], ends[2 * index + 1]])))].sort((a, b) => a - b);
    this.emit("change", undefined);
  }

  clear() {
    if (this.items.length > 0) this.set([]);
  }

  /** @param {Item} item */
  has(item) {
    return this.items.some((one) => isSame(one, item));
  }

  /** Adds an item, or removes it if it is selected. @param {Item} item */
  toggle(item) {
    this.set(this.has(item) ? this.items.filter((one) => !isSame(one, item)) : [...this.items, item]);
  }

  /** Selects only the item before or after the last one, of the same kind. @param {number} by */
  step(by) {
    const last = this.items.at(-1);
    const { scene } = this.simulation;
    if (last === undefined || scene === null) return;
    const count = last.kind === "particle" ? scene.particleCount : scene.constraintCount;
    this.set([{ kind: last.kind, index: (last.index + by + count) % count }]);
  }

  /** Goes from a particle to a constraint at it, and from a constraint to one of its ends. */
  turn() {
    const last = this.items.at(-1);
    const { scene } = this.simulation;
    if (last === undefined || scene === null) return;
    if (last.kind === "constraint") return this.set([{ kind: "particle", index: scene.ends[2 * last.index + 1] }]);
    const [index] = constraintsAt(scene, last.index, 1);
    if (index !== undefined) this.set([{ kind: "constraint", index }]);
  }
}

/** The first constraints at a particle. @param {import("../net/wire.js").Scene} scene @param {number} particle @param {number} limit */
export function constraintsAt({ ends, constraintCount }, particle, limit) {
  const found = [];
  for (let i = 0; i < constraintCount && found.length < limit; i++) if (ends[2 * i] === particle || ends[2 * i + 1] === particle) found.push(i);
  return found;
}

/** Reads "91, c12" as a particle and a constraint. Returns a sentence if that is not possible.
 * @param {string} text @param {import("../net/wire.js").Scene} scene @returns {Item[] | string} */
export function parseItems(text, scene) {
  const words = text.split(/[\s,;]+/).filter((word) => word !== "");
  if (words.length > SELECTED_MAX) return `At most ${SELECTED_MAX} particles and constraints can be selected.`;
  /** @type {Item[]} */
  const items = [];
  for (const word of words) {
    const [, letter, digits] = /^([cp]?)(\d+)$/i.exec(word) ?? [];
    if (digits === undefined) return `“${word}” is neither a particle, such as 91, nor a constraint, such as c12.`;
    const kind = letter.toLowerCase() === "c" ? "constraint" : "particle";
    const count = kind === "particle" ? scene.particleCount : scene.constraintCount;
    const index = Number(digits);
    if (index >= count) return `There is no ${kind} ${index}: the scene has ${count === 0 ? "none" : `0 to ${count - 1}`}.`;
    items.push({ kind, index });
  }
  return items;
}
