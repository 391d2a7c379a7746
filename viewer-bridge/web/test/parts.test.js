// Long messages in pieces: put together in order, unpacked, and with their progress.

import assert from "node:assert/strict";
import { deflateRawSync } from "node:zlib";
import { test } from "node:test";
import { Connector } from "../js/net/socket.js";

const PAST = 11;
const SCENE = 1;

/** A message that announces `count` others. */
function past(count) {
  const view = new DataView(new ArrayBuffer(24));
  view.setUint16(0, PAST, true);
  view.setUint16(2, 1, true);
  view.setUint32(16, count, true);
  return view.buffer;
}

/** The pieces of a message. `ofKind` is that of the whole. */
function partsOf(message, size, { isPacked = false, ofKind = PAST } = {}) {
  const whole = isPacked ? deflateRawSync(new Uint8Array(message)) : new Uint8Array(message);
  const parts = [];
  for (let offset = 0; offset < whole.length; offset += size) {
    const bytes = whole.subarray(offset, offset + size);
    const part = new Uint8Array(36 + Math.ceil(bytes.length / 4) * 4);
    const view = new DataView(part.buffer);
    view.setUint16(0, 13, true);
    view.setUint16(2, 1, true);
    [ofKind, offset, whole.length, isPacked ? message.byteLength : 0, bytes.length].forEach((value, k) => view.setUint32(16 + 4 * k, value, true));
    part.set(bytes, 36);
    parts.push(part.buffer);
  }
  return parts;
}

/** A connector without a socket, and what it passes on. */
function connector() {
  const log = [];
  const made = new Connector("", null, {
    onBinary: (message) => log.push(message.count),
    onText: (message) => log.push(message.type),
    onChange() {},
    onFault: (text) => log.push(text),
    onProgress: (share) => log.push(share === null ? "there" : `${Math.round(100 * share)} %`),
  });
  return { made, log };
}

/** Waits until the log has some entries. */
async function arrival(log, count) {
  for (let waits = 0; log.length < count && waits < 500; waits++) await new Promise((resolve) => { setTimeout(resolve, 10); });
}

test("a message in pieces arrives whole and in order", () => {
  const { made, log } = connector();
  made.receive(past(1));
  for (const part of partsOf(past(2), 8)) made.receive(part);
  made.receive(past(3));
  assert.deepEqual(log, [1, 2, 3]);
});

test("what follows a compressed message waits until that is unpacked", async () => {
  const { made, log } = connector();
  for (const part of partsOf(past(4), 7, { isPacked: true })) made.receive(part);
  made.receive("{\"type\":\"reset\",\"step\":1}");
  for (const part of partsOf(past(5), 9, { isPacked: true })) made.receive(part);
  made.receive(past(6));
  await arrival(log, 4);
  assert.deepEqual(log, [4, "reset", 5, 6]);
});

test("the progress of a scene is reported, and a connection that ends takes its pieces along", async () => {
  const { made, log } = connector();
  const [first, second] = partsOf(past(7), 12, { ofKind: SCENE });
  made.receive(first);
  made.receive(second);
  assert.deepEqual(log.splice(0), ["50 %", "100 %", 7, "there"]);
  for (const part of partsOf(past(8), 100, { isPacked: true })) made.receive(part);
  const { parts } = made;
  made.forget();
  while (parts.isBusy) await new Promise((resolve) => { setTimeout(resolve, 10); });
  assert.deepEqual(log, ["there"]);
});

test("a damaged message is reported, and the next ones arrive", async () => {
  const { made, log } = connector();
  const [damaged] = partsOf(past(9), 100, { isPacked: true, ofKind: SCENE });
  new Uint8Array(damaged).fill(0xff, 36);
  made.receive(damaged);
  made.receive(past(10));
  await arrival(log, 4);
  assert.deepEqual(log.slice(0, 2), ["100 %", "there"]);
  assert.match(log[2], /could not be read/);
  assert.deepEqual(log.slice(3), [10]);
});
