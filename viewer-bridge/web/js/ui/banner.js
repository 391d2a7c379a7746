// Messages to the user: one banner for a lasting state, notices for events.

import { make } from "./dom.js";

/** Lifetime of a notice, and limit on visible notices. */
const NOTICE_MS = 5000;
const NOTICES_MAX = 3;
/** Limit on notices kept for tests. */
const HISTORY_MAX = 100;

/** Causes of a banner, most severe first. Only one is shown. */
const ORDER = /** @type {const} */ (["fatal", "context", "connection", "receiving", "node", "nonFinite", "saturated", "past", "incomplete"]);

/** @typedef {typeof ORDER[number]} Cause */

export class Banner {
  /** @param {HTMLElement} element @param {HTMLElement} notices */
  constructor(element, notices) {
    this.element = element;
    this.notices = notices;
    /** @type {Map<Cause, string>} */
    this.causes = new Map();
    /** Texts of the last notices, for tests. @type {string[]} */
    this.history = [];
  }

  /** Sets the text for a cause, or clears it with "". @param {Cause} cause @param {string} text */
  set(cause, text) {
    if ((this.causes.get(cause) ?? "") === text) return;
    if (text === "") this.causes.delete(cause);
    else this.causes.set(cause, text);
    const worst = ORDER.find((one) => this.causes.has(one));
    this.element.hidden = worst === undefined;
    this.element.textContent = worst === undefined ? "" : this.causes.get(worst) ?? "";
    this.element.classList.toggle("is-error", worst === "fatal" || worst === "context" || worst === "nonFinite");
  }

  /** The text of the banner, or "". */
  get text() {
    return this.element.textContent ?? "";
  }

  /** Removes notices of what went well: they belong to the scene before. */
  dismissInfos() {
    for (const notice of this.notices.querySelectorAll(".is-info")) notice.remove();
  }

  /** @param {string} text @param {string} [level] "info", "warning" or "error" */
  notify(text, level = "info") {
    this.history.push(text);
    if (this.history.length > HISTORY_MAX) this.history.shift();
    const same = [...this.notices.children].find((one) => one.textContent === text);
    same?.remove();
    const notice = make("li", { class: `is-${level}` }, text);
    this.notices.append(notice);
    if (this.notices.children.length > NOTICES_MAX) this.notices.firstElementChild?.remove();
    setTimeout(() => notice.remove(), NOTICE_MS);
  }
}

/** Turns a message of a program, in lower case and without a full stop, into a sentence. @param {string} text */
export const sentence = (text) => `${text.charAt(0).toUpperCase()}${text.slice(1)}${/[.!?…]$/.test(text) ? "" : "."}`;
