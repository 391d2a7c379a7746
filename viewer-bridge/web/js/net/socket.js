// The connection to the bridge: introduces the page, passes messages on, acknowledges drawn frames,
// and reconnects with growing, randomised delays.

import { decode } from "./wire.js";

/** @typedef {"connecting" | "open" | "waiting" | "refused"} ConnectionState */
/** @typedef {{ state: ConnectionState, text: string }} Connection */
/**
 * @typedef {{
 *   onBinary(message: import("./wire.js").Message): void,
 *   onText(message: import("./messages.js").TextMessage): void,
 *   onChange(connection: Connection): void,
 *   onFault(text: string): void,
 *   onProgress(share: number | null): void,
 * }} Handlers  onProgress: the share of a long scene that has arrived, null once it is there
 */

export const PROTOCOL = 3;
const FIRST_DELAY_MS = 250;
const DELAY_MAX_MS = 5000;
/** Close codes after which another attempt cannot succeed. */
const FINAL_CODES = new Set([4400, 4401, 4404, 4426]);

/**
 * Delay before the next attempt, in ms. It doubles each time and has a random part, so that many
 * pages do not reconnect at the same moment.
 * @param {number} failures number of failures so far @param {number} random 0..1
 */
export const delayBefore = (failures, random) => Math.min(DELAY_MAX_MS, FIRST_DELAY_MS * 2 ** failures) * (1 + random / 2);

/** A message for the user about a closed connection. @param {number} code @param {string} reason @param {boolean} hasToken the page has sent a token */
export function closedText(code, reason, hasToken) {
  if (code === 4401 && hasToken) return "The token in this address is wrong, or of an earlier start of the bridge. Open the address that it printed last.";
  if (code === 4401) return "This bridge requires a token. Open the full address that it printed, including everything after the “#”.";
  if (code === 4404) return `This recording cannot be shown: ${reason}.`;
  if (code === 4426) return `The page and the bridge have different versions (${reason}). Reload the page.`;
  if (code === 4400) return `The bridge could not read a message from this page (${reason}). Reload the page.`;
  if (code === 1013) return "Too many pages are already open. Close one.";
  if (code === 4429) return "The page sent too many messages per second.";
  if (code === 4408) return "The connection was too slow or timed out.";
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
    /** Messages behind one that is being unpacked. @type {(string | ArrayBuffer)[]} */
    this.waiting = [];
    this.parts = this.partsOfConnection();
  }

  /** @returns {Parts} */
  partsOfConnection() {
    // What an earlier connection has not completed is lost.
    const parts = new Parts(
      (message) => { if (parts === this.parts) this.receiveBinary(message); },
      (share) => { if (parts === this.parts) this.handlers.onProgress(share); },
    );
    return parts;
  }

  /** Drops what the connection has not completed. */
  forget() {
    this.waiting = [];
    this.parts = this.partsOfConnection();
    this.handlers.onProgress(null);
  }

  connect() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.change({ state: "connecting", text: this.failures === 0 ? "Connecting…" : "Reconnecting…" });
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => this.opened();
    socket.onmessage = ({ data }) => this.receive(data);
    socket.onclose = ({ code, reason }) => this.closed(socket, code, reason);
  }

  /** Skips the rest of the delay: the tab is visible again, or the network is back. */
  retryNow() {
    if (this.connection.state === "waiting") this.connect();
  }

  opened() {
    const token = this.token === null ? {} : { token: this.token };
    this.send({ type: "hello", protocol: PROTOCOL, ...token, format: "auto", parts: true });
  }

  /** @param {WebSocket} socket @param {number} code @param {string} reason */
  closed(socket, code, reason) {
    if (socket !== this.socket) return;
    this.socket = null;
    this.forget();
    const text = closedText(code, reason, this.token !== null);
    if (FINAL_CODES.has(code)) return this.change({ state: "refused", text });
    const delay = delayBefore(this.failures++, Math.random());
    this.timer = setTimeout(() => this.connect(), delay);
    this.change({ state: "waiting", text: `${text} Trying again…` });
  }

  /** @param {string | ArrayBuffer} data */
  receive(data) {
    if (this.parts.isBusy) this.waiting.push(data);
    else if (typeof data === "string") this.receiveText(data);
    else this.receiveBinary(data);
  }

  /** Adds a piece of a long message, and then passes on what has waited for the whole. @param {import("./wire.js").Part} part */
  async receivePart(part) {
    const { parts } = this;
    try {
      await parts.add(part);
    } catch (error) {
      if (parts === this.parts) this.handlers.onFault(`A message could not be read: ${error}`);
    }
    // Another connection has its own.
    while (parts === this.parts && !parts.isBusy && this.waiting.length > 0) {
      try {
        this.receive(/** @type {string | ArrayBuffer} */ (this.waiting.shift()));
      } catch (error) {
        // The messages behind it still arrive in their order.
        this.handlers.onFault(`A message could not be read: ${error}`);
      }
    }
  }

  /** @param {string} data */
  receiveText(data) {
    const message = JSON.parse(data);
    if (message.type === "hello") {
      // The socket also opens before a refusal: only `hello` shows that the bridge accepted the page.
      this.failures = 0;
      this.change({ state: "open", text: "" });
    }
    this.handlers.onText(message);
  }

  /** @param {ArrayBuffer} data */
  receiveBinary(data) {
    try {
      const message = decode(data);
      if (message?.kind === "part") void this.receivePart(message);
      else if (message !== null) this.handlers.onBinary(message);
    } catch (error) {
      this.handlers.onFault(`A message could not be read: ${error}`);
    }
  }

  /** @param {object} message @returns {boolean} false if there is no connection */
  send(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** @param {number} frame number of the drawn frame */
  acknowledge(frame) {
    if (this.send({ type: "ack", frame })) this.framesAcknowledged++;
  }

  /** @param {Connection} connection */
  change(connection) {
    this.connection = connection;
    this.handlers.onChange(connection);
  }
}

/** @typedef {import("./wire.js").Part} Part */

/** Kind of a scene, of which the user wants to know how much has arrived. */
const SCENE = 1;

export class Parts {
  /** @param {(message: ArrayBuffer) => void} onMessage receives a whole message @param {(share: number | null) => void} onProgress receives the share of a scene that has arrived, and null once it is there */
  constructor(onMessage, onProgress) {
    this.onMessage = onMessage;
    this.onProgress = onProgress;
    /** The message so far. */
    this.bytes = new Uint8Array(0);
    /** True while a message is unpacked. */
    this.isBusy = false;
  }

  /** Adds a piece. Resolves once the message is whole and has been passed on, at once if pieces are missing; rejects if it cannot be unpacked. @param {Part} part */
  async add({ ofKind, offset, size, unpackedSize, bytes }) {
    if (offset === 0) this.bytes = new Uint8Array(size);
    this.bytes.set(bytes, offset);
    const end = offset + bytes.length;
    if (ofKind === SCENE) this.onProgress(end / size);
    if (end < size) return;
    const { bytes: whole } = this;
    this.bytes = new Uint8Array(0);
    this.isBusy = unpackedSize > 0;
    try {
      this.onMessage(this.isBusy ? await unpacked(whole, unpackedSize) : whole.buffer);
    } finally {
      this.isBusy = false;
      if (ofKind === SCENE) this.onProgress(null);
    }
  }
}

/** @param {Uint8Array<ArrayBuffer>} bytes a raw deflate stream @param {number} size of its content */
async function unpacked(bytes, size) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const message = await new Response(stream).arrayBuffer();
  if (message.byteLength !== size) throw new Error(`a message of ${size} bytes has ${message.byteLength}`);
  return message;
}
