// Tools when the scene changes under them.

import assert from "node:assert/strict";
import { test } from "node:test";
import { VIEWPORT, pageOf, sceneOf } from "./tools/page.js";

const SCENE = sceneOf([0, 0, 0]);

/** A page that shows one particle, and presses it with the left button. Returns the page and what it sends. */
function pressed() {
  const page = shown();
  page.listeners.get("pointerdown")(page.event);
  page.listeners.get("pointermove")({ ...page.event, clientX: page.event.clientX + 50 });
  return page;
}

/** A page that shows one particle, and an event of the mouse on it. */
const shown = (canChange = true) => pageOf(SCENE, canChange);

test("a reset or another scene ends a grab with a release, and without its last motion", () => {
  for (const change of [(page) => page.receiveText({ type: "reset", step: 2 }), (page) => page.receive({ ...SCENE, epoch: 2 })]) {
    const { input, simulation, sent } = pressed();
    assert.deepEqual(sent.map(({ kind }) => kind), ["grab"]);
    change(simulation);
    assert.deepEqual(sent.map(({ kind, particle }) => [kind, particle]), [["grab", 0], ["release", 0]]);
    assert.equal(input.tool, null);
  }
});

test("a lost connection drops the tool without a message", () => {
  const { input, sent } = pressed();
  input.abandon();
  assert.deepEqual([sent.length, input.tool], [1, null]);
});

test("a motion after a rest is as quick as one without", () => {
  const { input, sent } = pressed();
  const start = input.tool.sentMs;
  const moves = () => sent.filter(({ kind }) => kind === "move");
  input.tick(start + 16);
  // The pointer rests for a second.
  for (let ms = 32; ms <= 1000; ms += 16) input.tick(start + ms);
  input.tool.move({ x: 500, y: 300 }, start + 1010);
  input.tick(start + 1016);
  assert.equal(moves().length, 2);
  assert.ok(moves()[1].over_s < 0.03, `${moves()[1].over_s} s`);
});

/** Presses, moves by some pixels, and releases. */
function click({ listeners, event }, pixels, change = {}) {
  const there = { ...event, ...change };
  listeners.get("pointerdown")({ ...there, type: "pointerdown" });
  if (pixels > 0) listeners.get("pointermove")({ ...there, type: "pointermove", clientX: there.clientX + pixels });
  listeners.get("pointerup")({ ...there, type: "pointerup", clientX: there.clientX + pixels });
}

test("a click without motion selects and sends nothing, also in a recording", () => {
  for (const canChange of [true, false]) {
    const page = shown(canChange);
    click(page, 2);
    assert.deepEqual(page.selection.items, [{ kind: "particle", index: 0 }]);
    click(page, 0, { clientX: 20, clientY: 20 });
    assert.deepEqual([page.selection.items, page.sent], [[], []]);
    click(page, 0, { shiftKey: true });
    assert.equal(page.selection.items.length, 1);
    click(page, 0, { shiftKey: true });
    assert.equal(page.selection.items.length, 0);
  }
});

test("a drag grabs and does not select, and neither does a press that lasts", () => {
  const page = shown();
  click(page, 9);
  assert.deepEqual(page.sent.map(({ kind }) => kind).slice(0, 1), ["grab"]);
  assert.deepEqual(page.selection.items, []);
  const other = shown();
  other.listeners.get("pointerdown")(other.event);
  assert.deepEqual(other.sent, []);
  const { pressedMs } = other.input.tool;
  other.input.tick(pressedMs + 250);
  other.listeners.get("pointerup")({ ...other.event, type: "pointerup", timeStamp: pressedMs + 250 });
  assert.deepEqual(other.sent.map(({ kind }) => kind), ["grab", "release"]);
  assert.deepEqual(other.selection.items, []);
});

test("a click in another mode, a second finger and Escape select nothing", () => {
  const page = shown();
  page.input.mode = "pin";
  click(page, 0);
  assert.deepEqual([page.selection.items, page.sent.map(({ kind }) => kind)], [[], ["pin"]]);
  page.input.mode = "grab";
  page.listeners.get("pointerdown")(page.event);
  page.listeners.get("pointerdown")({ ...page.event, pointerId: 2 });
  page.listeners.get("pointerup")({ ...page.event, type: "pointerup", pointerId: 2 });
  page.listeners.get("pointerup")({ ...page.event, type: "pointerup" });
  assert.deepEqual(page.selection.items, []);
});

test("a busy page decides by the times of the events, not by those of their arrival", () => {
  // The release of a click arrives after the page has begun to grab.
  const click = shown();
  click.listeners.get("pointerdown")(click.event);
  const { pressedMs } = click.input.tool;
  click.input.tick(pressedMs + 500);
  click.listeners.get("pointerup")({ ...click.event, type: "pointerup", timeStamp: pressedMs + 90 });
  assert.deepEqual(click.selection.items, [{ kind: "particle", index: 0 }]);
  // The press of a long press arrives just before its release.
  const press = shown();
  const finger = { ...press.event, pointerType: "touch" };
  press.listeners.get("pointerdown")({ ...finger, timeStamp: finger.timeStamp - 700 });
  press.listeners.get("pointerup")({ ...finger, type: "pointerup" });
  assert.deepEqual(press.sent.map(({ kind }) => kind), ["pin"]);
  assert.deepEqual(press.selection.items, []);
  // All events of a throw arrive together.
  const thrown = shown();
  const [{ event, listeners, sent }, beginMs] = [thrown, thrown.event.timeStamp - 1000];
  const at = (type, ms, pixels) => listeners.get(type)({ ...event, type, timeStamp: beginMs + ms, clientX: event.clientX + pixels });
  at("pointerdown", 0, 0);
  at("pointermove", 400, 20);
  at("pointermove", 440, 60);
  at("pointerup", 441, 60);
  const move = sent.find(({ kind }) => kind === "move");
  const target = thrown.camera.project(move.target, VIEWPORT);
  const pixelsPerS = (60 - 20 * (360 / 400)) / 0.08;
  assert.ok(Math.abs(target.x - (event.clientX + 60 + pixelsPerS * move.over_s)) < 0.1, `x ${target.x} px`);
});

test("a timer that was held up waits for the release behind it", (context) => {
  let now = 1000;
  context.mock.method(performance, "now", () => now);
  context.mock.timers.enable({ apis: ["setTimeout"] });
  const begin = () => {
    const page = shown();
    page.listeners.get("pointerdown")({ ...page.event, pointerType: "touch", timeStamp: now });
    return page;
  };
  const quick = begin();
  // The page stands still for a second, in which the finger is lifted.
  now += 1000;
  context.mock.timers.tick(550);
  quick.listeners.get("pointerup")({ ...quick.event, pointerType: "touch", type: "pointerup", timeStamp: now - 900 });
  context.mock.timers.tick(1000);
  assert.deepEqual(quick.sent, []);
  const long = begin();
  now += 550;
  context.mock.timers.tick(550);
  assert.deepEqual(long.sent.map(({ kind }) => kind), ["pin"]);
  long.listeners.get("pointerup")({ ...long.event, pointerType: "touch", type: "pointerup", timeStamp: now + 50 });
  assert.deepEqual(long.selection.items, [], "the release selects nothing");
});

test("P pins what is selected, not what lies under the mouse, and unpins it if all of it is pinned", () => {
  const page = pageOf(sceneOf([0, 0, 0, 0.4, 0, 0, 0.8, 0, 0]));
  page.listeners.get("pointermove")({ ...page.event, type: "pointermove" });
  page.selection.set([{ kind: "particle", index: 1 }, { kind: "particle", index: 2 }]);
  const sent = () => page.sent.splice(0).map(({ kind, particle }) => [kind, particle]);
  page.simulation.expectPin(1, true);
  assert.ok(page.input.pinByKey());
  assert.deepEqual(sent(), [["pin", 2]]);
  page.simulation.expectPin(2, true);
  page.input.pinByKey();
  assert.deepEqual(sent(), [["unpin", 1], ["unpin", 2]]);
  page.selection.clear();
  page.input.pinByKey();
  assert.deepEqual(sent(), [["pin", 0]]);
});

test("a trackpad changes the brush by one step per notch, as a mouse does", () => {
  const page = shown();
  page.input.mode = "brush";
  const turn = (deltaY, deltaMode = 0) => page.listeners.get("wheel")({ deltaY, deltaMode, preventDefault() {} });
  const before = page.input.brushRadius;
  for (let k = 0; k < 24; k++) turn(4);
  assert.equal(page.input.brushRadius, before);
  turn(4);
  assert.equal(page.input.brushRadius, before - 10);
  turn(-120);
  assert.equal(page.input.brushRadius, before);
  turn(3, 1);
  assert.equal(page.input.brushRadius, before - 10, "a wheel that turns by lines");
  // A turn back begins anew.
  turn(90);
  turn(-90);
  turn(90);
  assert.equal(page.input.brushRadius, before - 10);
});
