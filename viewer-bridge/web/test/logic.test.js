// Everything else that needs no page: plots, the replay bar, links, parameters, reconnecting, state.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Commands } from "../js/commands.js";
import { stageOf } from "../js/framing.js";
import { formatLink, parseLink } from "../js/link.js";
import { ROWS, SLIDER_STEPS, placeOf, rangeOf, rowsOf, valueAt, valueOf } from "../js/parameters.js";
import { Series, niceCeiling, readable } from "../js/plot.js";
import { closedText, delayBefore } from "../js/socket.js";
import { Simulation } from "../js/state.js";
import { Scale, SeekGate, clockText, marksByPixel } from "../js/timeline.js";

test("a series keeps the newest samples, and a column shows its least and greatest", () => {
  const series = new Series(4);
  assert.equal(series.range(), null);
  for (const value of [1, 9, 2, 8, 3, 7]) series.push(value);
  assert.equal(series.last(), 7);
  assert.deepEqual(series.columns(2), [{ min: 2, max: 8 }, { min: 3, max: 7 }]);
  assert.deepEqual(series.range(), { min: 2, max: 8 });
});

test("a single peak is in its column, however narrow the plot", () => {
  const series = new Series(1200);
  for (let i = 0; i < 1200; i++) series.push(i === 700 ? 99 : 1);
  assert.equal(series.columns(50).filter((column) => column.max === 99).length, 1);
});

test("samples that are not known leave a gap", () => {
  const series = new Series(2);
  series.push(NaN);
  series.push(5);
  assert.deepEqual(series.columns(2), [null, { min: 5, max: 5 }]);
});

test("a scale ends at 1, 2 or 5 times a power of ten", () => {
  assert.deepEqual([0.03, 1, 1.01, 4.2, 5, 99, 1e-7].map(niceCeiling), [0.05, 1, 2, 5, 5, 100, 1e-7]);
  assert.equal(niceCeiling(0), 1);
});

test("numbers are written with the prefix that keeps them short", () => {
  assert.equal(readable(1234, "µs"), "1.23 ms");
  assert.equal(readable(0.0123, "%"), "1.23 %");
  assert.equal(readable(0.0005, "J"), "500 µJ");
  assert.equal(readable(NaN, "J"), "–");
});

test("a step and its place on the bar are each other's inverse, at both ends too", () => {
  const scale = new Scale(100, 340);
  for (const step of [100, 101, 220, 340]) assert.equal(scale.step(scale.fraction(step)), step);
  assert.equal(scale.step(-1), 100);
  assert.equal(scale.step(2), 340);
  assert.equal(new Scale(5, 5).fraction(5), 0);
});

test("marks that share a pixel are added up, each kind for itself", () => {
  const marks = [{ kind: "tear", step: 0, count: 2 }, { kind: "tear", step: 1, count: 3 }, { kind: "pin", step: 1, count: 1 }, { kind: "tear", step: 100, count: 4 }];
  const rows = marksByPixel(marks, new Scale(0, 100), 10);
  assert.deepEqual([...rows.get("tear")], [[0, 5], [9, 4]]);
  assert.deepEqual([...rows.get("pin")], [[0, 1]]);
});

test("scrubbing has one seek under way, and then goes where the hand is by now", () => {
  const sent = [];
  const answers = [];
  const gate = new SeekGate((step, done) => { sent.push(step); answers.push(done); return true; });
  for (const step of [10, 20, 30, 40]) gate.request(step);
  assert.deepEqual(sent, [10]);
  answers[0]();
  assert.deepEqual(sent, [10, 40]);
  answers[0]();
  assert.deepEqual(sent, [10, 40], "an answer that comes twice opens nothing");
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

test("a link gives back the view that it was made of", () => {
  const link = { scene: "spring & cloth", camera: { target: [0.1, -2, 300], distance: 4, yaw: -0.5, pitch: 0.2 }, toggles: { heat: true, sticks: false } };
  assert.deepEqual(parseLink(`#${formatLink(link)}`), { token: null, ...link });
});

test("a link that is cut or written by hand is read as far as it makes sense", () => {
  assert.deepEqual(parseLink("#token=abc"), { token: "abc", scene: null, camera: null, toggles: {} });
  for (const camera of ["1,2,3", "1,2,3,x,5,6", "1,2,3,-4,5,6", "", "1,2,3,Infinity,5,6"]) assert.equal(parseLink(`camera=${camera}`).camera, null);
  assert.equal(parseLink("").scene, null);
});

test("every slider gives back the value that it shows, within its grain", () => {
  for (const row of ROWS) {
    const range = rangeOf(row);
    for (let place = 0; place <= SLIDER_STEPS; place += 7) {
      const value = valueAt(row, range, place);
      assert.ok(value >= range.least * (1 - 1e-9) || (row.hasZero && value === 0) || row.least < 0, `${row.name} ${value}`);
      assert.ok(Math.abs(placeOf(row, range, value) - place) <= (row.kind === "whole" ? 20 : row.kind === "log" ? 2 : 1), `${row.name} at ${place}`);
    }
  }
});

test("a scene in pixels widens the range of its gravity, and keeps zero in the middle", () => {
  const gravity = ROWS.find((row) => row.name === "gravity");
  const range = rangeOf(gravity, 0, 981, 0);
  assert.ok(range.most >= 981 && range.least === -range.most);
  assert.equal(valueAt(gravity, range, placeOf(gravity, range, 0)), 0);
});

test("the softness that is shown is the one of the scene's method", () => {
  const names = (method) => rowsOf(method).map((row) => row.name);
  assert.ok(names("xpbd").includes("compliance") && !names("xpbd").includes("stiffness"));
  assert.ok(names("pbd").includes("stiffness") && !names("pbd").includes("compliance"));
});

test("a parameter is read for one kind of constraints, and infinity is a word", () => {
  const values = { compliance: { structural: 0.5, shear: null }, tear_force: null, max_speed: "inf" };
  assert.equal(valueOf(values, "compliance", "structural"), 0.5);
  assert.equal(valueOf(values, "compliance", "shear"), null);
  assert.equal(valueOf(values, "tear_force", "structural"), null);
  assert.equal(valueOf(values, "max_speed", "structural"), Infinity);
  assert.equal(valueOf(null, "damping", "structural"), null);
});

test("the pause before another try doubles up to 5 s, and half of it is by chance", () => {
  assert.deepEqual([0, 1, 2, 3, 4, 5, 20].map((failures) => delayBefore(failures, 0)), [250, 500, 1000, 2000, 4000, 5000, 5000]);
  assert.equal(delayBefore(0, 1), 375);
  assert.equal(delayBefore(20, 1), 7500);
});

test("a refusal that no other try changes says what to do", () => {
  assert.match(closedText(4401, ""), /token/);
  assert.match(closedText(4426, "2"), /reload/);
  assert.match(closedText(1006, ""), /No connection/);
});

test("each outcome goes to who asked, and a refusal is also told to the user", () => {
  const sent = [];
  const refused = [];
  const heard = [];
  const commands = new Commands((message) => sent.push(message) > 0, (outcome) => refused.push(outcome.reason));
  commands.run("pin", { particle: 3 }, (outcome) => heard.push(outcome.status));
  commands.run("cut", { epoch: 1, constraints: [4] }, (outcome) => heard.push(outcome.status));
  assert.deepEqual(sent.map(({ type, id }) => [type, id]), [["pin", 1], ["cut", 2]]);
  commands.receive({ id: 2, status: "rejected", reason: "unknown_constraint" });
  commands.receive({ id: 1, status: "applied", reason: "" });
  commands.receive({ id: null, status: "rejected", reason: "not_grabbed" });
  assert.deepEqual(heard, ["rejected", "applied"]);
  assert.deepEqual(refused, ["unknown_constraint", "not_grabbed"]);
  assert.equal(commands.waiting.size, 0);
});

const scene = (epoch, rest = {}) => ({
  kind: "scene", epoch, step: 0, particleCount: 2, constraintCount: 1, triangleCount: 0, isPlanar: false, up: "y",
  positions: Float32Array.from([0, 1, 0, 0, 0, 0]), ends: Uint32Array.from([0, 1]), restLengths: Float32Array.from([1]),
  triangles: new Uint32Array(0), constraintKinds: new Uint8Array(1), min: [0, 0, 0], max: [0, 1, 0], name: "two", ...rest,
});
const frame = (epoch, number, rest = {}) => ({
  kind: "frame", epoch, step: number, number, particleCount: 2, lo: [0, 0, 0], scale: [1, 1, 1],
  positions: Float32Array.from([0, 1, 0, 0, 0.5, 0]), nonFinite: new Uint32Array(0), ...rest,
});
const tear = (epoch, first, ...constraints) => ({ kind: "tear", epoch, first, constraints: Uint32Array.from(constraints) });

test("a frame of another epoch is not shown, but its number is known, to be acknowledged", () => {
  const simulation = new Simulation();
  simulation.receive(scene(7));
  simulation.receive(frame(6, 41));
  assert.equal(simulation.frame, null);
  assert.equal(simulation.frameNumber, 41);
  simulation.receive(frame(7, 42));
  assert.deepEqual(simulation.position(1), [0, 0.5, 0]);
  assert.equal(simulation.position(2), null);
});

test("a list of tears is cut and continued, and an empty one mends everything", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive(tear(1, 0, 0));
  assert.deepEqual([simulation.torn, simulation.topology.isGone[0]], [[0], 1]);
  simulation.receive(tear(1, 0));
  assert.deepEqual([simulation.torn, simulation.topology.isGone[0]], [[], 0]);
});

test("a live bridge at the address of a replay leaves nothing of the recording", () => {
  const simulation = new Simulation();
  simulation.receiveText({ type: "hello", mode: "replay" });
  simulation.receiveText({ type: "timeline", marks: [] });
  simulation.receiveText({ type: "playback", is_playing: false });
  const heard = [];
  for (const topic of ["timeline", "playback"]) simulation.on(topic, (what) => heard.push([topic, what]));
  simulation.receiveText({ type: "hello", mode: "live" });
  assert.deepEqual([simulation.timeline, simulation.playback, simulation.isPaused], [null, null, false]);
  assert.deepEqual(heard, [["timeline", null], ["playback", null]]);
});

test("a list of tears may be as long as a big sheet has constraints", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  const count = 1_000_000;
  simulation.receive({ kind: "tear", epoch: 1, first: 0, constraints: new Uint32Array(count) });
  assert.equal(simulation.torn.length, count);
});

test("a reset takes back cuts and pins that were expected and never published", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1, { constraintCount: 2, ends: Uint32Array.of(0, 1, 1, 0), restLengths: Float32Array.of(1, 1), constraintKinds: new Uint8Array(2) }));
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  simulation.receive(tear(1, 0, 0));
  simulation.expectCut(1, [1]);
  simulation.expectPin(0, false);
  simulation.expectPin(1, true);
  assert.deepEqual([[...simulation.topology.isGone], [...simulation.pins]], [[1, 1], [[1, 1]]]);
  const heard = [];
  for (const topic of ["tear", "pins", "reset"]) simulation.on(topic, () => heard.push(topic));
  simulation.receiveText({ type: "reset", step: 0 });
  assert.deepEqual([[...simulation.topology.isGone], [...simulation.pins]], [[1, 0], [[0, 1]]]);
  assert.deepEqual(heard.sort(), ["pins", "reset", "tear"], "what draws them hears of it");
});

test("what joins a particle that is not finite is away, and comes back with it", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive(frame(1, 1, { nonFinite: Uint32Array.of(1) }));
  assert.equal(simulation.topology.isGone[0], 1);
  simulation.receive(frame(1, 2));
  assert.equal(simulation.topology.isGone[0], 0);
});

test("a new scene forgets what was torn and held", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  simulation.receive(tear(1, 0, 0));
  simulation.receive(scene(2));
  assert.deepEqual([simulation.torn, simulation.pins.size, simulation.frame], [[], 0, null]);
});

test("the ground is a floor where there is one, else below what can hang lowest", () => {
  const simulation = new Simulation();
  simulation.receive(scene(1));
  simulation.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0), flags: Uint32Array.of(1) });
  assert.ok(simulation.ground.offset < 0 && simulation.ground.offset > -0.1);
  simulation.receive({ kind: "colliders", epoch: 1, colliders: [{ shape: "plane", normal: [0, 1, 0], offset: -2 }] });
  assert.equal(simulation.ground.offset, -2);
});

test("the first look has room for a point, a floor below, and what anchors carry", () => {
  const point = new Simulation();
  point.receive(scene(1, { particleCount: 1, constraintCount: 0, positions: Float32Array.of(1, 2, 3), min: [1, 2, 3], max: [1, 2, 3] }));
  assert.deepEqual(stageOf(point), { min: [0.5, 1.5, 2.5], max: [1.5, 2.5, 3.5] });
  const plane = new Simulation();
  plane.receive(scene(1, { isPlanar: true }));
  const before = stageOf(plane);
  plane.receive({ kind: "colliders", epoch: 1, colliders: [{ shape: "plane", normal: [0, 1, 0], offset: before.min[1] - 1 }] });
  assert.equal(stageOf(plane).min[1], before.min[1] - 1);
  const carried = new Simulation();
  carried.receive(scene(1));
  carried.receive({ kind: "pins", epoch: 1, particles: Uint32Array.of(0, 1), flags: Uint32Array.of(4, 4) });
  assert.ok(stageOf(carried).max[0] > carried.box().max[0]);
});
