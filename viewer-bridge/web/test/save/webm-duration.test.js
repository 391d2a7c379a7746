// The duration that is written into a WebM video.

import assert from "node:assert/strict";
import { test } from "node:test";
import { withDuration } from "../../js/save/webm-duration.js";

/** An element with a content shorter than 127 bytes. */
const element = (id, ...content) => [...id, 0x80 | content.flat().length, ...content.flat()];
const HEADER = element([0x1a, 0x45, 0xdf, 0xa3], element([0x42, 0x82], [0x77, 0x65, 0x62, 0x6d]));
const SEGMENT = [0x18, 0x53, 0x80, 0x67, 0x01, ...Array(7).fill(0xff)];
const INFO = [0x15, 0x49, 0xa9, 0x66];
const UNIT_100_US = element([0x2a, 0xd7, 0xb1], [0x01, 0x86, 0xa0]);
const APP = element([0x4d, 0x80], [0x61, 0x70, 0x70]);
const SEEK_HEAD = [0x11, 0x4d, 0x9b, 0x74];
const EMPTY_SEEK_HEAD = [...SEEK_HEAD, 0x01, ...Array(7).fill(0)];
const REST = [0x16, 0x54, 0xae, 0x6b, 0x81, 0x00];

const patched = async (bytes, seconds) => [...new Uint8Array(await new Blob(withDuration(Uint8Array.from(bytes), seconds)).arrayBuffer())];
const doubleOf = (bytes) => new DataView(Uint8Array.from(bytes).buffer).getFloat64(0);

test("a stream gets its duration in its unit of time, and keeps everything else", async () => {
  const bytes = await patched([...HEADER, ...SEGMENT, ...element(INFO, UNIT_100_US, APP), ...REST], 2.5);
  const begin = HEADER.length + SEGMENT.length;
  const content = [...UNIT_100_US, ...APP];
  assert.deepEqual(bytes.slice(0, begin), [...HEADER, ...SEGMENT]);
  assert.deepEqual(bytes.slice(begin, begin + 12), [...INFO, 1, 0, 0, 0, 0, 0, 0, content.length + 11]);
  assert.deepEqual(bytes.slice(begin + 12, begin + 12 + content.length), content);
  const end = begin + 12 + content.length + 11;
  assert.deepEqual(bytes.slice(end - 11, end - 8), [0x44, 0x89, 0x88]);
  assert.equal(doubleOf(bytes.slice(end - 8, end)), 25_000);
  assert.deepEqual(bytes.slice(end), REST);
});

test("the unit is a millisecond unless the file says otherwise", async () => {
  for (const scale of [[], element([0x2a, 0xd7, 0xb1])]) {
    const bytes = await patched([...HEADER, ...SEGMENT, ...element(INFO, scale, APP)], 2.5);
    assert.equal(doubleOf(bytes.slice(-8)), 2500);
  }
});

test("the room that Firefox leaves is filled", async () => {
  const rest = [...APP, ...REST];
  const file = (duration) => [...HEADER, ...SEGMENT, ...EMPTY_SEEK_HEAD, ...INFO, 1, 0, 0, 0, 0, 0, 0, 11 + APP.length, 0x44, 0x89, 0x88, ...duration, ...rest];
  const bytes = await patched(file(Array(8).fill(0)), 2.5);
  const at = bytes.length - rest.length - 8;
  assert.equal(doubleOf(bytes.slice(at, at + 8)), 2500);
  assert.deepEqual(bytes, file(bytes.slice(at, at + 8)), "nothing else has changed");
});

test("a file that has a duration, a size or positions, and anything else, stays as it is", async () => {
  const duration = element([0x44, 0x89], [0x3f, 0x80, 0, 0]);
  const files = {
    duration: [...HEADER, ...SEGMENT, ...element(INFO, APP, duration)],
    size: [...HEADER, ...element(SEGMENT.slice(0, 4), element(INFO, APP))],
    positions: [...HEADER, ...SEGMENT, ...element(SEEK_HEAD, [0x4d, 0xbb, 0x80]), ...element(INFO, APP)],
    "an incomplete element": [...HEADER, ...SEGMENT, ...element(INFO, APP)].slice(0, -2),
    "a size without a first bit": [...HEADER, ...SEGMENT, ...element(INFO, [0x4d, 0x80, ...Array(40).fill(0)])],
    "another file": [...new TextEncoder().encode("....ftypisom, a video of another format")],
    "an empty one": [],
  };
  for (const [name, bytes] of Object.entries(files)) assert.deepEqual(await patched(bytes, 1), bytes, name);
});
