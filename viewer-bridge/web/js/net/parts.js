// Long messages arrive in pieces. They are put together in order: what follows a message waits until it is unpacked.

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
