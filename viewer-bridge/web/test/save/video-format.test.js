// The format of a video: what the browser can write, and what encoders accept.

import assert from "node:assert/strict";
import { test } from "node:test";

import { TYPES, bitsPerSecond, chooseType, endingOf, videoSize } from "../../js/save/video.js";

test("the most widely played format is chosen that the browser can write", () => {
  assert.equal(chooseType(() => true), TYPES[0]);
  assert.equal(chooseType((type) => type.startsWith("video/webm")), "video/webm;codecs=vp9");
  assert.equal(chooseType((type) => type === "video/webm"), "video/webm");
  assert.equal(chooseType(() => false), null);
});

test("the ending of the file is that of its format", () => {
  assert.deepEqual(TYPES.map(endingOf), ["mp4", "webm", "webm", "webm", "mp4"]);
});

test("the sides of a video are even and not too long", () => {
  assert.deepEqual(videoSize({ width: 801, height: 599 }), { width: 800, height: 598 });
  assert.deepEqual(videoSize({ width: 8192, height: 2048 }), { width: 4096, height: 1024 });
  assert.deepEqual(videoSize({ width: 1, height: 9000 }), { width: 2, height: 4096 });
});

test("the rate of bits grows with the picture within limits", () => {
  assert.equal(bitsPerSecond({ width: 320, height: 240 }), 2.5e6);
  assert.equal(bitsPerSecond({ width: 1280, height: 720 }), Math.round(1280 * 720 * 30 * 0.15));
  assert.equal(bitsPerSecond({ width: 4096, height: 4096 }), 40e6);
});
