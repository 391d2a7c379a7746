// What the user has to be told: one banner for a state that lasts, notices for what passes.

import { make } from "./dom.js";

/** How long a notice stays, and how many there are at once. */
const NOTICE_MS = 5000;
const NOTICES_MAX = 3;

/** Reasons for a banner, the gravest first: only one is shown. */
const ORDER = /** @type {const} */ (["fatal", "context", "connection", "node", "nonFinite", "saturated"]);

/** @typedef {typeof ORDER[number]} Cause */

export class Banner {
  /** @param {HTMLElement} element @param {HTMLElement} notices */
  constructor(element, notices) {
    this.element = element;
    this.notices = notices;
    /** @type {Map<Cause, string>} */
    this.causes = new Map();
    /** Everything that was said, for tests. @type {string[]} */
    this.said = [];
  }

  /** Sets or, with "", takes away what is said for a cause. @param {Cause} cause @param {string} text */
  set(cause, text) {
    if ((this.causes.get(cause) ?? "") === text) return;
    if (text === "") this.causes.delete(cause);
    else this.causes.set(cause, text);
    const gravest = ORDER.find((one) => this.causes.has(one));
    this.element.hidden = gravest === undefined;
    this.element.textContent = gravest === undefined ? "" : this.causes.get(gravest) ?? "";
    this.element.classList.toggle("is-error", gravest === "fatal" || gravest === "context" || gravest === "nonFinite");
  }

  /** The text of the banner, "" without one. */
  get text() {
    return this.element.textContent ?? "";
  }

  /** @param {string} text @param {string} [level] "info", "warning" or "error" */
  notify(text, level = "info") {
    this.said.push(text);
    if (this.said.length > 100) this.said.shift();
    const same = [...this.notices.children].find((one) => one.textContent === text);
    same?.remove();
    const notice = make("li", { class: `is-${level}` }, text);
    this.notices.append(notice);
    if (this.notices.children.length > NOTICES_MAX) this.notices.firstElementChild?.remove();
    setTimeout(() => notice.remove(), NOTICE_MS);
  }
}

/** Programs say it in lower case and without an end. @param {string} text */
export const sentence = (text) => `${text.charAt(0).toUpperCase()}${text.slice(1)}${/[.!?…]$/.test(text) ? "" : "."}`;
