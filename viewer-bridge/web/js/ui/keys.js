// Keyboard shortcuts: one table from keys to actions.

/** @typedef {Record<string, () => void>} Keymap  keyed by KeyboardEvent.key, with letters in lower case */

/** Elements that handle keys themselves. */
const KEY_CONSUMERS = "input, select, textarea, dialog";

/** @param {Keymap} keymap */
export function listenToKeys(keymap) {
  // A click on the picture focuses it too, but only focus by Tab shows the focus ring.
  document.addEventListener("pointerdown", () => { delete document.documentElement.dataset.tabbed; });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Tab") document.documentElement.dataset.tabbed = "";
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target instanceof Element ? event.target : null;
    if (target?.closest(KEY_CONSUMERS)) return;
    // Space and Enter press a focused button: a shortcut on top could undo that.
    if (target?.closest("button") && (event.key === " " || event.key === "Enter")) return;
    const action = keymap[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}
