// The words about a recording, the reasons against one, and the address of its page.

import assert from "node:assert/strict";
import { test } from "node:test";

import { clock, describe, endsAfterMs, isRunning, losses, readableBytes, reasonAgainst, replayAddress } from "../../js/save/recording.js";

const RECORDING = { type: "recording", state: "recording", text: "", name: null, path: null, seconds: 83.9, snapshots: 2937, size_bytes: 8_123_456, lost: {} };
const LIVE = { isConnected: true, isReplay: false, hasNode: true };

test("a time is shown as on a clock", () => {
  assert.deepEqual([0, 9.99, 60, 3599, 3600, 36_061, -1].map(clock), ["0:00", "0:09", "1:00", "59:59", "1:00:00", "10:01:01", "0:00"]);
});

test("a size has a decimal prefix", () => {
  assert.deepEqual([0, 999, 1000, 8_123_456, 1e9, 1e12, 1e15].map(readableBytes), ["0 B", "999 B", "1 kB", "8.12 MB", "1 GB", "1 TB", "1000 TB"]);
});

test("losses name their topics", () => {
  assert.equal(losses({}), "nothing lost");
  assert.equal(losses({ "/particles": 3, "/tears": 1 }), "lost 3 /particles, 1 /tears");
});

test("the line of a recording has its time, size and losses, and the reason of an end", () => {
  const line = (/** @type {object} */ changes) => describe({ ...RECORDING, ...changes });
  assert.equal(line({}), "1:23 · 8.12 MB · nothing lost");
  assert.equal(line({ lost: { "/steps": 2 } }), "1:23 · 8.12 MB · lost 2 /steps");
  assert.equal(line({ snapshots: 0 }), "1:23 · waits for the next step");
  assert.equal(line({ state: "finishing" }), "Finishing · 1:23 · 8.12 MB · nothing lost");
  assert.equal(line({ state: "finished" }), "Recorded 1:23 · 8.12 MB · nothing lost");
  assert.equal(line({ state: "finished", text: "the recording ended with the node" }), "The recording ended with the node. 1:23 · 8.12 MB · nothing lost");
  assert.equal(line({ state: "failed", text: "no space left" }), "Recording failed: no space left.");
});

test("the button gives the reason why it does nothing", () => {
  const reason = (/** @type {object | null} */ changes, page = {}) => reasonAgainst(changes && { ...RECORDING, ...changes }, { ...LIVE, ...page });
  assert.equal(reason({ state: "idle" }), "");
  assert.equal(reason({ state: "finished" }), "");
  assert.match(reason({ state: "idle" }, { isConnected: false }), /connection/);
  assert.match(reason(null, { isReplay: true }), /already/);
  assert.match(reason(null), /makes no recordings/);
  assert.equal(reason({ state: "unavailable", text: "start it with --recordings DIR" }), "Start it with --recordings DIR.");
  assert.match(reason({ state: "finishing" }), /being written/);
  assert.match(reason({ state: "idle" }, { hasNode: false }), /No node/);
  assert.equal(reason({}, { hasNode: false }), "", "a recording can be stopped without a node");
});

test("a recording runs until its end is written", () => {
  const states = ["unavailable", "idle", "recording", "finishing", "finished", "failed"];
  assert.deepEqual(states.filter((state) => isRunning({ ...RECORDING, state })), ["recording", "finishing"]);
  assert.equal(isRunning(null), false);
});

test("the address of a recording is relative and carries the token", () => {
  const address = (/** @type {string | null} */ token) => new URL(replayAddress("curtain_1", token), "http://host:8080/").href;
  assert.equal(address(null), "http://host:8080/replay/curtain_1/");
  assert.equal(address("a b"), "http://host:8080/replay/curtain_1/#token=a%20b");
});

test("a finished recording leaves the other pages, but not the one that asked for it, and a failure stays", () => {
  const finished = { ...RECORDING, state: "finished" };
  assert.equal(endsAfterMs(finished, true), Infinity);
  assert.ok(endsAfterMs(finished, false) < 60_000);
  assert.equal(endsAfterMs({ ...RECORDING, state: "failed" }, false), Infinity);
});
