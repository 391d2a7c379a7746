// A text field for a value beside its slider.

import { make } from "../ui/dom.js";
import { keyName } from "../ui/keys.js";
import { editable, typedValue } from "./parameters.js";

/** @typedef {import("./parameters.js").Row} Row */
/** @typedef {import("../net/messages.js").ParameterValue} ParameterValue */

export class ValueField {
  /** @param {Row} row @param {string} label for screen readers @param {{ onValue: (value: number | null) => void, onWrong: (text: string) => void, onUndo: () => void }} on */
  constructor(row, label, { onValue, onWrong, onUndo }) {
    this.input = make("input", { type: "text", inputmode: "decimal", class: "value", "aria-label": label, autocomplete: "off", spellcheck: "false" });
    this.shown = "";
    this.input.addEventListener("focus", () => this.input.select());
    this.input.addEventListener("change", () => {
      const value = typedValue(row, this.input.value);
      if (value !== undefined) return onValue(value);
      onWrong(this.input.value);
      this.input.value = this.shown;
    });
    this.input.addEventListener("keydown", (event) => {
      const { key } = event;
      // The browser's own undo would show an older value than that of the node.
      if ((event.ctrlKey || event.metaKey) && key.toLowerCase() === "z") event.preventDefault();
      if (keyName(event) === "ctrl+z") {
        if (this.input.value === this.shown) onUndo();
        else this.input.value = this.shown;
      }
      // Escape leaves the field without a change.
      if (key === "Escape") this.input.value = this.shown;
      if (key === "Escape" || key === "Enter") this.input.blur();
    });
  }

  /** Shows a value, unless the user is typing another one. @param {ParameterValue} value @param {string} [word] in place of "off" */
  show(value, word = "off") {
    const isTyped = this.input.matches(":focus") && this.input.value !== this.shown;
    this.shown = typeof value === "number" ? editable(value) : word;
    if (!isTyped && this.input.value !== this.shown) this.input.value = this.shown;
  }
}
