// The legends within a saved picture: their lines, their places and their colours.

import assert from "node:assert/strict";
import { test } from "node:test";

import { fitted } from "../../js/save/picture.js";
import { drawLegends, layOut, wrap } from "../../js/save/legend-art.js";

const AREA = { width: 800, height: 600 };
const STYLE = { colors: { surface: "white", line: "gray", text: "black", soft: "dimgray" }, ramp: ["blue", "gray", "yellow"] };
const STRAIN = { title: "Strain", ends: ["-0.5 %", "0", "0.5 %"], lines: ["min -0.1 %, max 0.3 %"] };
const FORCE = { title: "Force 1 N", arrow: { length: 72, color: "teal" }, lines: [] };

const measure = (/** @type {string} */ text) => 6 * text.length;

/** A canvas context that remembers what it has drawn. */
function paper() {
  const drawn = { texts: [], boxes: [], fills: [], stops: [] };
  const context = {
    font: "", fillStyle: "", strokeStyle: "", lineWidth: 1, textAlign: "left", textBaseline: "top",
    save() {}, restore() {}, beginPath() {}, fill() {}, stroke() {}, moveTo() {}, lineTo() {},
    measureText: (text) => ({ width: measure(text) }),
    roundRect: (...box) => drawn.boxes.push(box),
    fillRect: (x, y, width) => drawn.fills.push({ x, y, width, style: context.fillStyle }),
    fillText: (text, x, y, width) => drawn.texts.push({ text, x, y, width, align: context.textAlign, font: context.font, style: context.fillStyle }),
    createLinearGradient: () => ({ addColorStop: (at, color) => drawn.stops.push([at, color]) }),
  };
  return { context, drawn };
}

test("long texts are wrapped between words", () => {
  assert.deepEqual(wrap("one two three", 48, measure), ["one two", "three"]);
  assert.deepEqual(wrap("incompressible a", 48, measure), ["incompressible", "a"]);
  assert.deepEqual(wrap("", 48, measure), []);
});

test("a legend grows with its contents, and no row overlaps another", () => {
  const note = { ...STRAIN, lines: ["Rigid or torn, so unknown: 12 of 596 constraints. Positions are rounded."] };
  const heights = [FORCE, STRAIN, note].map((legend) => layOut(legend, measure).height);
  assert.ok(heights[0] < heights[1] && heights[1] < heights[2], String(heights));
  const { rows, height } = layOut(note, measure);
  rows.forEach(({ y }, place) => assert.ok(y > (rows[place - 1]?.y ?? 0) && y < height));
});

test("legends stand above each other in the lower right corner", () => {
  const { context, drawn } = paper();
  drawLegends(context, [STRAIN, FORCE], AREA, STYLE);
  const [lower, upper] = drawn.boxes;
  assert.deepEqual([lower[0] + lower[2], lower[1] + lower[3]], [788, 588]);
  assert.equal(upper[0], lower[0]);
  assert.ok(upper[1] + upper[3] < lower[1]);
  const find = (text) => drawn.texts.find((one) => one.text === text);
  assert.ok(find("Strain").y < find("Force 1 N").y);
  const ends = STRAIN.ends.map(find);
  assert.deepEqual(ends.map(({ align }) => align), ["left", "center", "right"]);
  assert.deepEqual(ends.map(({ x }) => x - ends[0].x), [0, 90, 180]);
  assert.deepEqual(drawn.stops, [[0, "blue"], [0.5, "gray"], [1, "yellow"]]);
  assert.ok(drawn.fills.some(({ style }) => style === "teal"));
  // No text leaves its box.
  for (const { width } of drawn.texts) assert.ok(width <= 180);
});

test("kinds of constraints have swatches in their colours", () => {
  const { context, drawn } = paper();
  drawLegends(context, [{ title: "Kind", kinds: [{ text: "distance: 596", color: "navy" }], lines: [] }], AREA, STYLE);
  const [swatch] = drawn.fills;
  const kind = drawn.texts.find(({ text }) => text === "distance: 596");
  assert.equal(swatch.style, "navy");
  assert.equal(kind.style, "black");
  assert.match(drawn.texts[0].font, /^600 /);
  assert.doesNotMatch(kind.font, /^600 /);
  assert.ok(kind.x > swatch.x + swatch.width);
});

test("a picture fits into another one without distortion, in its middle", () => {
  assert.deepEqual(fitted({ width: 200, height: 100 }, { width: 400, height: 400 }), { x: 0, y: 100, width: 400, height: 200 });
  assert.deepEqual(fitted({ width: 100, height: 200 }, { width: 100, height: 100 }), { x: 25, y: 0, width: 50, height: 100 });
});
