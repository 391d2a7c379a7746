// Counts the messages of a recording by topic, with the indexed reader of @mcap/core.
//
// usage: count_messages.js RECORDING

import { open } from "node:fs/promises";

import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const file = await open(process.argv[2], "r");
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
    return bytes.subarray(0, bytesRead);
  },
};
const decompressHandlers = await loadDecompressHandlers();
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const counts = {};
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const { topic } = reader.channelsById.get(message.channelId);
  counts[topic] = (counts[topic] ?? 0) + 1;
}
const total = Object.values(counts).reduce((sum, count) => sum + count, 0);
if (BigInt(total) !== reader.statistics.messageCount) {
  throw new Error(`${total} messages, but the statistics count ${reader.statistics.messageCount}`);
}
console.log(JSON.stringify(counts));
