// The timeline of a recording, and links to a view.

import assert from "node:assert/strict";
import { test } from "node:test";
import { formatLink, parseLink } from "../../js/view/link.js";
import { Scale, SeekGate, clockText, marksByPixel } from "../../js/timeline/timeline.js";

test("a step and its position on the timeline convert back, including at both ends", () => {
  const scale = new Scale(100, 340);
  for (const step of [100, 101, 220, 340]) assert.equal(scale.step(scale.fraction(step)), step);
  assert.equal(scale.step(-1), 100);
  assert.equal(scale.step(2), 340);
  assert.equal(new Scale(5, 5).fraction(5), 0);
});

test("marks that share a pixel are added up per kind", () => {
  const marks = [{ kind: "tear", step: 0, count: 2 }, { kind: "tear", step: 1, count: 3 }, { kind: "pin", step: 1, count: 1 }, { kind: "tear", step: 100, count: 4 }];
  const rows = marksByPixel(marks, new Scale(0, 100), 10);
  assert.deepEqual([...rows.get("tear")], [[0, 5], [9, 4]]);
  assert.deepEqual([...rows.get("pin")], [[0, 1]]);
});

test("scrubbing sends one seek at a time, and then the newest step", () => {
  const sent = [];
  const answers = [];
  const gate = new SeekGate((step, done) => { sent.push(step); answers.push(done); return true; });
  for (const step of [10, 20, 30, 40]) gate.request(step);
  assert.deepEqual(sent, [10]);
  answers[0]();
  assert.deepEqual(sent, [10, 40]);
  answers[0]();
  assert.deepEqual(sent, [10, 40], "a repeated answer starts no seek");
  answers[1]();
  gate.request(50);
  assert.deepEqual(sent, [10, 40, 50]);
});

test("a seek without a connection blocks nothing", () => {
  let isConnected = false;
  const sent = [];
  const gate = new SeekGate((step) => { if (isConnected) sent.push(step); return isConnected; });
  gate.request(1);
  isConnected = true;
  gate.request(2);
  assert.deepEqual(sent, [2]);
});

test("a time is minutes, seconds and milliseconds", () => {
  assert.deepEqual([0, 1.0005, 59.9999, 61.25, 3600].map(clockText), ["0:00.000", "0:01.001", "1:00.000", "1:01.250", "60:00.000"]);
});

test("a link restores the view that it was made from", () => {
  const link = { scene: "spring & cloth", camera: { target: [0.1, -2, 300], distance: 4, yaw: -0.5, pitch: 0.2 }, colour: "tension", toggles: { heat: true, sticks: false } };
  assert.deepEqual(parseLink(`#${formatLink(link)}`), { token: null, ...link });
});

test("a truncated or hand-written link is read as far as it is valid", () => {
  assert.deepEqual(parseLink("#token=abc"), { token: "abc", scene: null, camera: null, colour: "strain", toggles: {} });
  assert.equal(parseLink("colour=blue").colour, "strain");
  for (const camera of ["1,2,3", "1,2,3,x,5,6", "1,2,3,-4,5,6", "", "1,2,3,Infinity,5,6"]) assert.equal(parseLink(`camera=${camera}`).camera, null);
  assert.equal(parseLink("").scene, null);
});
