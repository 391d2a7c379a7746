// Keyboard shortcuts: one table from keys to actions.

import { find } from "./dom.js";

/** @typedef {Record<string, () => void>} Keymap  keyed by KeyboardEvent.key, with letters in lower case; "ctrl+" stands before a key with Ctrl or Cmd */

/** Keys that move the choice of a focused list or slider. */
const MOVES = new Set(["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"]);
/** Keys that press a focused button or switch. */
const PRESSES = new Set([" ", "Enter"]);
/** Types of input elements that take no text. */
const SWITCHES = new Set(["checkbox", "radio"]);

/**
 * True if a focused element handles a key itself, so that it is not a shortcut.
 * @param {{ tagName: string, type?: string }} element @param {string} key
 */
export function isConsumed({ tagName, type = "" }, key) {
  if (tagName === "BUTTON" || (tagName === "INPUT" && SWITCHES.has(type))) return PRESSES.has(key);
  if (tagName === "SELECT") return MOVES.has(key) || key === "Enter";
  if (tagName === "INPUT") return type !== "range" || MOVES.has(key);
  return tagName === "TEXTAREA";
}

/** The name of a pressed key in a keymap, or null for a combination that the browser keeps.
 * @param {{ key: string, ctrlKey: boolean, metaKey: boolean, altKey: boolean, shiftKey: boolean, repeat: boolean }} event */
export function keyName({ key, ctrlKey, metaKey, altKey, shiftKey, repeat }) {
  const name = key.length === 1 ? key.toLowerCase() : key;
  if (altKey) return null;
  if (!ctrlKey && !metaKey) return name;
  // A held key would undo everything.
  return shiftKey || repeat ? null : `ctrl+${name}`;
}

/** Key of the choice in localStorage. */
const CHARACTERS_OFF = "catenary-character-keys-off";

/** Uses the storage of the browser; null if the user blocks it. @template T @param {(storage: Storage) => T} use */
function stored(use) {
  try {
    return use(localStorage);
  } catch {
    return null;
  }
}

/** True for a key that types a character, as dictation and a slip of the hand do. The space bar and Ctrl with a key are not among them. @param {string} name */
export const isCharacter = (name) => name.length === 1 && name !== " ";

/** The switch for shortcuts of a single character. Its choice belongs to the browser. */
export class CharacterKeys {
  constructor() {
    this.box = find("character-keys", HTMLInputElement);
    this.box.checked = stored((storage) => storage.getItem(CHARACTERS_OFF)) === null;
    this.box.addEventListener("change", () => {
      stored((storage) => (this.box.checked ? storage.removeItem(CHARACTERS_OFF) : storage.setItem(CHARACTERS_OFF, "")));
    });
  }

  /** @param {string} name of a pressed key */
  allows(name) {
    return this.box.checked || !isCharacter(name);
  }
}

/** @param {Keymap} keymap @param {CharacterKeys} characters */
export function listenToKeys(keymap, characters) {
  // A click on the picture focuses it too, but only focus by Tab shows the focus ring.
  document.addEventListener("pointerdown", () => { delete document.documentElement.dataset.tabbed; });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Tab") document.documentElement.dataset.tabbed = "";
    const name = keyName(event);
    if (name === null || !characters.allows(name)) return;
    const control = event.target instanceof Element ? event.target.closest("button, input, select, textarea") : null;
    if (document.querySelector("dialog[open]") !== null || (control !== null && isConsumed(/** @type {HTMLInputElement} */ (control), event.key))) return;
    const action = keymap[name];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

/** Gives the focus back to the picture once a pointer has used a control. A keyboard user keeps it. @param {HTMLElement} picture */
export function returnFocus(picture) {
  let isPointer = false;
  document.addEventListener("pointerdown", () => { isPointer = true; }, { capture: true });
  document.addEventListener("keydown", () => { isPointer = false; }, { capture: true });
  const giveBack = (/** @type {Event} */ event) => {
    const control = event.target instanceof Element ? event.target.closest("button, select, input") : null;
    if (!isPointer || control === null || document.querySelector("dialog[open]") !== null) return;
    const isText = control instanceof HTMLInputElement && !SWITCHES.has(control.type) && control.type !== "range";
    // A select has its choice at `change`; a click only opens it.
    if (isText || (event.type === "click" && control.tagName === "SELECT")) return;
    picture.focus({ preventScroll: true });
  };
  document.addEventListener("click", giveBack);
  document.addEventListener("change", giveBack);
}
