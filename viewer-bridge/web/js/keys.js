// The keyboard: one table from keys to what they do.

/** @typedef {Record<string, () => void>} Keymap  by KeyboardEvent.key, letters in lower case */

/** Elements that need their own keys. */
const TYPING = "input, select, textarea, dialog";

/** @param {Keymap} keymap */
export function listenToKeys(keymap) {
  // Keys also work after a click on the picture: its frame is for those who came to it by Tab.
  document.addEventListener("pointerdown", () => { delete document.documentElement.dataset.tabbed; });
  document.addEventListener("keydown", (event) => {
    if (event.key === "Tab") document.documentElement.dataset.tabbed = "";
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target instanceof Element ? event.target : null;
    if (target?.closest(TYPING)) return;
    // A focused button is pressed by the space bar: doing two things at once would undo one.
    if (target?.closest("button") && (event.key === " " || event.key === "Enter")) return;
    const action = keymap[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}
