// The surface laid flat: distances along the cloth are those at rest, however it is folded.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Topology } from "../../js/state/topology.js";
import { layFlat } from "../../js/state/weave.js";

const COLUMNS = 4;
const ROWS = 3;

/** A sheet of COLUMNS x ROWS particles with structural and shear constraints, at any positions. */
function sheet(positionOf, first = 0) {
  const at = (column, row) => first + row * COLUMNS + column;
  const [ends, restLengths, kinds, triangles] = [[], [], [], []];
  const link = (a, b, length, kind) => {
    ends.push(a, b);
    restLengths.push(length);
    kinds.push(kind);
  };
  for (let row = 0; row < ROWS; row++) {
    for (let column = 0; column < COLUMNS; column++) {
      if (column + 1 < COLUMNS) link(at(column, row), at(column + 1, row), 1, 0);
      if (row + 1 < ROWS) link(at(column, row), at(column, row + 1), 1, 0);
      if (column + 1 === COLUMNS || row + 1 === ROWS) continue;
      link(at(column, row), at(column + 1, row + 1), Math.SQRT2, 1);
      triangles.push(at(column, row), at(column, row + 1), at(column + 1, row + 1), at(column, row), at(column + 1, row + 1), at(column + 1, row));
    }
  }
  const count = first + COLUMNS * ROWS;
  return {
    particleCount: count, constraintCount: kinds.length, triangleCount: triangles.length / 3, positions: Float32Array.from({ length: 3 * count }, (_, k) => positionOf(Math.floor(k / 3))[k % 3]),
    ends: Uint32Array.from(ends), restLengths: Float32Array.from(restLengths), constraintKinds: Uint8Array.from(kinds), triangles: Uint32Array.from(triangles),
  };
}

const between = (flat, a, b) => [flat[2 * b] - flat[2 * a], flat[2 * b + 1] - flat[2 * a + 1]];

test("a folded sheet is laid flat with its rest lengths, and its threads run along the axes", () => {
  // All particles lie on one line: only the rest lengths tell the shape.
  const flat = layFlat(new Topology(sheet((particle) => [particle, 0, 0])));
  const corner = between(flat, 0, COLUMNS * ROWS - 1);
  assert.ok(Math.abs(Math.hypot(...corner) - Math.hypot(COLUMNS - 1, ROWS - 1)) < 1e-5, `${corner}`);
  for (const [a, b] of [[0, 1], [1, 2], [0, COLUMNS], [5, 9]]) {
    const thread = between(flat, a, b).map(Math.abs).sort((x, y) => x - y);
    assert.ok(thread[0] < 1e-5 && Math.abs(thread[1] - 1) < 1e-5, `${a} ${b}: ${thread}`);
  }
});

test("particles without a triangle have no place, and each sheet begins anew", () => {
  const scene = sheet((particle) => [particle, 0, 0], 1);
  const flat = layFlat(new Topology(scene));
  assert.deepEqual([flat[0], flat[1]], [0, 0]);
  assert.ok(Math.abs(Math.hypot(...between(flat, 1, 1 + COLUMNS * ROWS - 1)) - Math.hypot(COLUMNS - 1, ROWS - 1)) < 1e-5);
});
