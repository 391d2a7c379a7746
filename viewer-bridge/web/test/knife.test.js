// The knife is watertight: after a stroke across a moving cloth, nothing connects its two sides.

import assert from "node:assert/strict";
import { test } from "node:test";
import { crossedSticks, projectAll } from "../js/geometry/pick.js";

const COLUMNS = 14;
const ROWS = 12;
const VIEWPORT = { width: 800, height: 600 };
/** Shows x from 0 to 800 and y from 600 to 0 as pixels. */
const PIXELS = [2 / 800, 0, 0, 0, 0, -2 / 600, 0, 0, 0, 0, 1, 0, -1, 1, 0, 1];
const SPACING = 40;
const CORNER = { x: 140, y: 80 };

/** Random numbers from 0 to 1 that are the same in each run (the minimal standard generator). */
function generator(seed) {
  let state = seed;
  return () => (state = (state * 48271) % 2147483647) / 2147483647;
}

/** A sheet with structural and both shear constraints in each cell. */
function sheet() {
  const at = (c, r) => r * COLUMNS + c;
  const ends = [];
  for (let r = 0; r < ROWS; r++) {
    for (let c = 0; c < COLUMNS; c++) {
      if (c + 1 < COLUMNS) ends.push(at(c, r), at(c + 1, r));
      if (r + 1 < ROWS) ends.push(at(c, r), at(c, r + 1));
      // The second diagonal names its ends in the other order.
      if (c + 1 < COLUMNS && r + 1 < ROWS) ends.push(at(c, r), at(c + 1, r + 1), at(c, r + 1), at(c + 1, r));
    }
  }
  return Uint32Array.from(ends);
}

/** The pixels of the cloth in a frame: each particle sways by itself, by less than `sway`. */
function cloth(frame, sway, phases) {
  const positions = new Float32Array(3 * COLUMNS * ROWS);
  for (let p = 0; p < COLUMNS * ROWS; p++) {
    positions[3 * p] = CORNER.x + (p % COLUMNS) * SPACING + sway * Math.sin(0.7 * frame + phases[p]);
    positions[3 * p + 1] = CORNER.y + Math.floor(p / COLUMNS) * SPACING + sway * Math.cos(0.9 * frame + 2 * phases[p]);
  }
  return projectAll({ positions, lo: [0, 0, 0], scale: [1, 1, 1] }, PIXELS, VIEWPORT);
}

/** True if intact constraints connect two particles. */
function isConnected(ends, isGone, from, to) {
  const group = Int32Array.from({ length: COLUMNS * ROWS }, (_, p) => p);
  const root = (p) => {
    while (group[p] !== p) p = group[p] = group[group[p]];
    return p;
  };
  for (let i = 0; i < isGone.length; i++) if (!isGone[i]) group[root(ends[2 * i])] = root(ends[2 * i + 1]);
  return root(from) === root(to);
}

const KINDS = /** @type {const} */ (["along", "across", "between"]);

/** A stroke from one side of the cloth to the other. `track` is its row or column, or between two of them. */
function strokeOf(kind, random) {
  const count = kind === "across" ? COLUMNS : ROWS;
  const track = 2 + Math.floor(random() * (count - 5)) + (kind === "between" ? 0.5 : 0);
  const wobble = random() < 0.25 ? 0 : random() * 0.8 * SPACING;
  const stops = 3 + Math.floor(random() * 30);
  return Array.from({ length: stops + 1 }, (_, k) => {
    const isEnd = k === 0 || k === stops;
    const aside = track * SPACING + (isEnd ? 0 : (random() - 0.5) * 2 * wobble);
    if (kind === "across") return { x: CORNER.x + aside, y: 10 + (k / stops) * 580 };
    return { x: 10 + (k / stops) * 780, y: CORNER.y + aside };
  });
}

test("1,000 random strokes along, across and between rows of a moving cloth leave no thread", () => {
  const random = generator(20260101);
  const ends = sheet();
  let cuts = 0;
  for (let run = 0; run < 1000; run++) {
    const kind = KINDS[run % KINDS.length];
    const sway = run % 10 === 0 ? 0 : random() * 0.5 * SPACING;
    const phases = Array.from({ length: COLUMNS * ROWS }, () => random() * 2 * Math.PI);
    const isGone = new Uint8Array(ends.length / 2);
    const stroke = strokeOf(kind, random);
    let past = cloth(0, sway, phases);
    let at = stroke.shift();
    for (let frame = 1; stroke.length > 0; frame++) {
      // The pointer rests in some frames, and moves several times in others.
      const path = [at, ...stroke.splice(0, Math.floor(random() * 4))];
      const now = cloth(frame, sway, phases);
      for (const one of crossedSticks(now, past, ends, isGone, path)) isGone[one] = 1;
      [past, at] = [now, path[path.length - 1]];
    }
    const opposite = kind === "across" ? COLUMNS - 1 : (ROWS - 1) * COLUMNS;
    assert.ok(!isConnected(ends, isGone, 0, opposite), `stroke ${run}, ${kind}, sway ${sway}: a thread remains`);
    cuts += isGone.reduce((sum, one) => sum + one, 0);
  }
  // The knife is no saw: a stroke without wobble meets three constraints per cell.
  assert.ok(cuts / 1000 < 6 * 3 * COLUMNS, `${cuts / 1000} constraints per stroke`);
});
