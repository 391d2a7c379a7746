// The connection to the bridge: it says hello, hands on what comes, acknowledges what was drawn, and
// comes back by itself with growing, random pauses.

import { decode } from "./wire.js";

/** @typedef {"connecting" | "open" | "waiting" | "refused"} ConnectionState */
/** @typedef {{ state: ConnectionState, text: string }} Connection */
/**
 * @typedef {{
 *   onBinary(message: import("./wire.js").Message): void,
 *   onText(message: import("./messages.js").TextMessage): void,
 *   onChange(connection: Connection): void,
 *   onFault(text: string): void,
 * }} Handlers
 */

export const PROTOCOL = 1;
const FIRST_DELAY_MS = 250;
const DELAY_MAX_MS = 5000;
/** Closed for a reason that another try does not change. */
const FINAL_CODES = new Set([4400, 4401, 4426]);

/**
 * How long to wait before the next try: doubling, with a random part, so that the pages of a node
 * that comes back do not all knock at once.
 * @param {number} failures so far, from 0 @param {number} random 0..1
 */
export const delayBefore = (failures, random) => Math.min(DELAY_MAX_MS, FIRST_DELAY_MS * 2 ** failures) * (1 + random / 2);

/** What a closed connection means to the user. @param {number} code @param {string} reason */
export function closedText(code, reason) {
  if (code === 4401) return "This bridge asks for a token: open the address that it printed, with everything behind the “#”.";
  if (code === 4426) return `The page and the bridge are of different versions (${reason}): reload the page.`;
  if (code === 4400) return `The bridge did not understand this page (${reason}): reload the page.`;
  if (code === 4429) return "Too many messages in a second.";
  if (code === 4408) return "The connection was too slow.";
  return "No connection to the bridge.";
}

export class Connector {
  /** @param {string} url @param {string | null} token @param {Handlers} handlers */
  constructor(url, token, handlers) {
    this.url = url;
    this.token = token;
    this.handlers = handlers;
    /** @type {WebSocket | null} */
    this.socket = null;
    /** @type {Connection} */
    this.connection = { state: "connecting", text: "Connecting…" };
    this.failures = 0;
    this.timer = 0;
    this.framesAcknowledged = 0;
  }

  connect() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.change({ state: "connecting", text: this.failures === 0 ? "Connecting…" : "Reconnecting…" });
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => this.opened();
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.receiveText(data) : this.receiveBinary(data));
    socket.onclose = ({ code, reason }) => this.closed(socket, code, reason);
  }

  /** Tries at once: the tab is visible again, or the network is back. */
  hurry() {
    if (this.connection.state === "waiting") this.connect();
  }

  opened() {
    const token = this.token === null ? {} : { token: this.token };
    this.send({ type: "hello", protocol: PROTOCOL, ...token, format: "auto" });
  }

  /** @param {WebSocket} socket @param {number} code @param {string} reason */
  closed(socket, code, reason) {
    if (socket !== this.socket) return;
    this.socket = null;
    const text = closedText(code, reason);
    if (FINAL_CODES.has(code)) return this.change({ state: "refused", text });
    const delay = delayBefore(this.failures++, Math.random());
    this.timer = setTimeout(() => this.connect(), delay);
    this.change({ state: "waiting", text: `${text} Trying again…` });
  }

  /** @param {string} data */
  receiveText(data) {
    const message = JSON.parse(data);
    if (message.type === "hello") {
      // Only now has the bridge let this page in: a refusal also begins with an open socket.
      this.failures = 0;
      this.change({ state: "open", text: "" });
    }
    this.handlers.onText(message);
  }

  /** @param {ArrayBuffer} data */
  receiveBinary(data) {
    try {
      const message = decode(data);
      if (message !== null) this.handlers.onBinary(message);
    } catch (error) {
      this.handlers.onFault(`A message could not be read: ${error}`);
    }
  }

  /** @param {object} message @returns {boolean} whether there was a connection to send it by */
  send(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** @param {number} frame number of the frame that was drawn */
  acknowledge(frame) {
    if (this.send({ type: "ack", frame })) this.framesAcknowledged++;
  }

  /** @param {Connection} connection */
  change(connection) {
    this.connection = connection;
    this.handlers.onChange(connection);
  }
}
