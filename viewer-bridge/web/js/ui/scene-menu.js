// The menu of scenes: a picture, the name and a line of text for each.

import { find, make } from "./dom.js";

/** @typedef {import("../net/messages.js").SceneEntry} SceneEntry */

/** Number of scenes whose cards have a digit key. */
const DIGITS = 9;

/** The scene `by` places after `name` in a list that continues at its start; the first one if the name is not in it.
 * @param {SceneEntry[]} scenes @param {string | null} name @param {number} by @returns {SceneEntry | undefined} */
export function neighbour(scenes, name, by) {
  const index = scenes.findIndex((one) => one.name === name);
  return index < 0 ? scenes[0] : scenes[(index + by + scenes.length) % scenes.length];
}

/** The card that an arrow key goes to from another one, in rows of `columns`. It stays within the list.
 * @param {number} index @param {string} key @param {number} columns @param {number} count */
export function cardAfter(index, key, columns, count) {
  const by = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns }[key] ?? 0;
  return index + by < 0 || index + by >= count ? index : index + by;
}

export class SceneMenu {
  /** @param {(scene: string) => void} load */
  constructor(load) {
    this.dialog = find("scene-dialog", HTMLDialogElement);
    this.list = find("scenes", HTMLUListElement);
    this.load = load;
    this.built = "";
    this.dialog.addEventListener("click", (event) => { if (event.target === this.dialog) this.dialog.close(); });
    this.list.addEventListener("keydown", (event) => this.move(event));
  }

  /** Opens the menu with the focus on a card: that of the current scene, unless another one is asked for.
   * @param {SceneEntry[]} scenes @param {string | null} current @param {string | null} [focused] */
  open(scenes, current, focused = current) {
    this.build(scenes);
    for (const card of this.cards()) {
      if (card.dataset.scene === current) card.setAttribute("aria-current", "true");
      else card.removeAttribute("aria-current");
    }
    this.dialog.showModal();
    (this.cards().find((card) => card.dataset.scene === focused) ?? this.cards()[0])?.focus();
  }

  cards() {
    return [...this.list.querySelectorAll("button")];
  }

  /** @param {SceneEntry[]} scenes */
  build(scenes) {
    const built = scenes.map((one) => one.name).join();
    if (built === this.built) return;
    this.built = built;
    this.list.replaceChildren(...scenes.map((scene, index) => make("li", {}, this.card(scene, index))));
  }

  /** @param {SceneEntry} scene @param {number} index */
  card({ name, text, rate_hz, picture }, index) {
    const key = index < DIGITS ? [make("kbd", {}, String(index + 1))] : [];
    const card = make("button", { type: "button", "data-scene": name },
      picture === undefined ? make("i", { class: "picture", "aria-hidden": "true" }) : make("img", { class: "picture", src: picture, width: 320, height: 240, alt: "" }),
      make("strong", {}, name, ...key), make("span", {}, text), make("small", {}, `${rate_hz} Hz`));
    card.addEventListener("click", () => {
      this.dialog.close();
      this.load(name);
    });
    return card;
  }

  /** @param {KeyboardEvent} event */
  move(event) {
    const cards = this.cards();
    const index = cards.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const top = cards[0]?.getBoundingClientRect().top;
    const columns = Math.max(1, cards.findIndex((card) => card.getBoundingClientRect().top > top));
    if (index < 0 || !event.key.startsWith("Arrow")) return;
    event.preventDefault();
    cards[cardAfter(index, event.key, columns, cards.length)].focus();
  }
}

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
