// The plots: series over simulation time, the values at a cursor, and the table of all of them.

import assert from "node:assert/strict";
import { test } from "node:test";
import { heights, csvOf } from "../js/panel/charts.js";
import { drawLine, Series } from "../js/panel/plot.js";

function series(capacity, ...samples) {
  const one = new Series(capacity);
  for (const [time, value] of samples) one.push(time, value);
  return one;
}

const samples = (one) => Array.from({ length: one.size }, (_, k) => [one.timeAt(k), one.valueAt(k)]);

test("a series keeps the newest samples with their times", () => {
  const one = series(3, [1, 10], [2, 20], [3, 30], [4, 40], [5, 50]);
  assert.deepEqual(samples(one), [[3, 30], [4, 40], [5, 50]]);
  assert.equal(one.last(), 50);
  one.clear();
  assert.ok(Number.isNaN(one.last()));
});

test("a replay that goes back replaces what it plays again, and a step on show again its own value", () => {
  const one = series(8, [1, 10], [2, 20], [3, 30], [2, 21]);
  assert.deepEqual(samples(one), [[1, 10], [2, 21]]);
  one.push(2, 22);
  one.push(2.5, 25);
  assert.deepEqual(samples(one), [[1, 10], [2, 22], [2.5, 25]]);
  const full = series(2, [1, 1], [2, 2], [3, 3], [0, 0]);
  assert.deepEqual(samples(full), [[0, 0]]);
});

test("the value at the cursor is the nearest sample, unless it is far away", () => {
  const one = series(8, [1, 10], [2, 20], [3, 30]);
  assert.deepEqual([1, 1.4, 1.6, 2.9, 3.2, 0.5].map((time) => one.near(time, 0.6)), [10, 10, 20, 30, 30, 10]);
  assert.ok(Number.isNaN(one.near(4, 0.6)) && Number.isNaN(new Series(2).near(0, 1)));
});

test("the range covers the window, without unknown samples", () => {
  const one = series(8, [1, -5], [2, 3], [3, NaN], [4, 7], [5, 100]);
  assert.deepEqual(one.range(2, 4), { min: 3, max: 7 });
  assert.deepEqual(one.range(0, 9), { min: -5, max: 100 });
  assert.equal(one.range(2.5, 3.5), null);
});

test("a held copy does not change", () => {
  const one = series(2, [1, 10], [2, 20]);
  const copy = one.clone();
  one.push(3, 30);
  assert.deepEqual(samples(copy), [[1, 10], [2, 20]]);
});

test("the table has a row per time and step, and empty cells where a plot has no sample", () => {
  const height = series(4, [0.5, 1.25], [0.75, NaN], [1, -2]);
  const energy = series(4, [0.75, 3]);
  const text = csvOf([{ name: "Height lowest (m)", series: height }, { name: 'Energy "sum", all', series: energy }], 240);
  assert.equal(text, 'time_s,step,Height lowest (m),"Energy ""sum"", all"\r\n0.5,120,1.25,\r\n0.75,180,,3\r\n1,240,-2,\r\n');
  assert.equal(csvOf([], 240), "time_s,step\r\n");
});

test("a height is measured along the up axis of the scene", () => {
  const frame = { bounds: { min: [0, -3, 1], max: [9, 5, 2] }, particleCount: 1 };
  assert.deepEqual(heights(frame, [0, 1, 0]), { low: -3, high: 5 });
  assert.deepEqual(heights(frame, [0, -1, 0]), { low: -5, high: 3 });
  assert.deepEqual(heights(frame, [0, 0, 1]), { low: 1, high: 2 });
  assert.ok(Number.isNaN(heights({ ...frame, particleCount: 0 }, [0, 1, 0]).low));
});

/** The strokes of a series in a plot that is 10 pixels wide and high: lists of points. */
function strokes(one, window) {
  const paths = [];
  let left = 0;
  const context = {
    beginPath() {}, stroke() {}, translate: (x) => { left += x; },
    moveTo: (x, y) => paths.push([[left + x, y]]), lineTo: (x, y) => paths.at(-1).push([left + x, y]),
  };
  drawLine(context, one, { cursor: null, ...window }, 10, (value) => value, "");
  assert.equal(left, 0, "what is drawn next is in its place");
  return paths;
}

test("a single peak is visible in its column, however narrow the plot", () => {
  const one = series(1200, ...Array.from({ length: 1000 }, (_, k) => [k, k === 700 ? 99 : 1]));
  const [path] = strokes(one, { from: 0, to: 1000, gap: 5 });
  assert.deepEqual(path.filter(([, y]) => y === 99), [[7.5, 99]]);
});

test("unknown samples, and a time without any, interrupt the line", () => {
  const one = series(8, [1, 4], [2, 5], [3, NaN], [4, 6], [5, 6], [9, 7]);
  const starts = strokes(one, { from: 0, to: 10, gap: 2 }).map(([first]) => first);
  assert.deepEqual(starts, [[1.5, 4], [4.5, 6], [9.5, 7]]);
});
