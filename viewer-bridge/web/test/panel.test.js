// Plots, number formats and sliders of the panel.

import assert from "node:assert/strict";
import { test } from "node:test";
import { SLIDER_STEPS, editable, hasBends, partsOf, positionOf, rangeOf, restoring, rowsOf, typedValue, unitOf, valueAt, withSurfaces } from "../js/panel/parameters.js";
import { ROWS } from "../js/panel/tables.js";
import { valueOf } from "../js/net/messages.js";
import { niceCeiling } from "../js/geometry/math.js";
import { readable } from "../js/ui/format.js";

test("a scale ends at 1, 2 or 5 times a power of ten", () => {
  assert.deepEqual([0.03, 1, 1.01, 4.2, 5, 99, 1e-7].map(niceCeiling), [0.05, 1, 2, 5, 5, 100, 1e-7]);
  assert.equal(niceCeiling(0), 1);
});

test("numbers are formatted with a suitable metric prefix", () => {
  assert.equal(readable(1234, "µs"), "1.23 ms");
  assert.equal(readable(0.0123, "%"), "1.23 %");
  assert.equal(readable(0.0005, "J"), "500 µJ");
  assert.equal(readable(NaN, "J"), "–");
});

test("a slider position and its value convert back, within the precision of the slider", () => {
  for (const row of ROWS) {
    const range = rangeOf(row);
    for (let position = 0; position <= SLIDER_STEPS; position += 7) {
      const value = valueAt(row, range, position);
      assert.ok(value >= range.least * (1 - 1e-9) || (row.hasZero && value === 0) || row.least < 0, `${row.name} ${value}`);
      assert.ok(Math.abs(positionOf(row, range, value) - position) <= (row.kind === "whole" ? 20 : row.kind === "log" ? 2 : 1), `${row.name} at ${position}`);
    }
  }
});

test("a scene in pixels widens the range of gravity and keeps zero in the middle", () => {
  const gravity = ROWS.find((row) => row.name === "gravity");
  const range = rangeOf(gravity, 0, 981, 0);
  assert.ok(range.most >= 981 && range.least === -range.most);
  assert.equal(valueAt(gravity, range, positionOf(gravity, range, 0)), 0);
});

test("the panel shows compliance for XPBD and stiffness for PBD", () => {
  const names = (method) => rowsOf(method, false).map((row) => row.name);
  assert.ok(names("xpbd").includes("compliance") && !names("xpbd").includes("stiffness"));
  assert.ok(names("pbd").includes("stiffness") && !names("pbd").includes("compliance"));
});

test("a parameter is read for one constraint kind, and infinity is a word", () => {
  const values = { compliance: { structural: 0.5, shear: null }, tear_force: null, max_speed: "inf" };
  assert.equal(valueOf(values, "compliance", "structural"), 0.5);
  assert.equal(valueOf(values, "compliance", "shear"), null);
  assert.equal(valueOf(values, "tear_force", "structural"), null);
  assert.equal(valueOf(values, "max_speed", "structural"), Infinity);
  assert.equal(valueOf(null, "damping", "structural"), null);
});

const row = (name) => ROWS.find((one) => one.name === name);

test("a typed value is a number, or off where the parameter can be off", () => {
  assert.equal(typedValue(row("damping"), " 0.25 "), 0.25);
  assert.equal(typedValue(row("damping"), "0,25"), 0.25);
  assert.equal(typedValue(row("tear_force"), "1e-3"), 0.001);
  assert.equal(typedValue(row("tear_force"), "Off"), null);
  assert.equal(typedValue(row("iterations"), "8"), 8);
  for (const [name, text] of [["damping", "off"], ["damping", ""], ["damping", "fast"], ["damping", "1/0"], ["damping", "Infinity"], ["iterations", "1.5"]]) {
    assert.equal(typedValue(row(name), text), undefined, `${name} ${text}`);
  }
});

test("a shown value keeps the digits of a 32-bit number, so that typing it again changes nothing", () => {
  for (const value of [0.3, 9.80665, 1e-7, -20, 0]) assert.equal(editable(Math.fround(value)), String(value));
  assert.equal(editable(null), "off");
});

test("resetting the parameters changes those that differ, and names those that cannot be restored", () => {
  const initial = { gravity: [0, -9.81, 0], damping: 0.3, tear_force: null, compliance: { structural: null, shear: 0.1 } };
  const values = { gravity: [0, -9.81, 0], damping: 2, tear_force: 50, compliance: { structural: 1e-3, shear: 0.2 } };
  const rows = ["gravity", "damping", "tear_force", "compliance"].map(row);
  assert.deepEqual(restoring(rows, values, initial, ["structural", "shear"]), {
    changes: [{ name: "damping", value: 0.3 }, { name: "tear_force", value: null }, { name: "compliance", value: 0.1, part: "shear" }],
    lost: ["Compliance"],
  });
  assert.deepEqual(restoring(rows, initial, initial, ["structural", "shear"]), { changes: [], lost: [] });
});

const SHAPES = [{ shape: "cloth", has_bends: true }, { shape: "web", has_bends: false }, { shape: "rope", has_bends: true }];

test("a scene with bends has a row for them, with a choice of the shapes that bend", () => {
  const names = (hasBends) => rowsOf("xpbd", hasBends).map((row) => row.name);
  assert.ok(names(true).includes("bending") && !names(false).includes("bending"));
  const parts = (name, shapes, hasExplicitBends = false) => partsOf(row(name), { shapes, hasExplicitBends }, ["shear"]);
  assert.deepEqual(parts("bending", SHAPES), [{ part: "0", text: "0 cloth" }, { part: "2", text: "2 rope" }]);
  assert.deepEqual(parts("bending", SHAPES.slice(1)), [], "all is the same");
  assert.deepEqual(parts("bending", SHAPES.slice(1), true), [{ part: "1", text: "1 rope" }], "all has other bends, too");
  assert.deepEqual(parts("compliance", SHAPES), [{ part: "shear", text: "shear" }]);
  assert.deepEqual(parts("damping", SHAPES), []);
  const has = (shapes, hasExplicitBends) => hasBends({ shapes, hasExplicitBends });
  assert.deepEqual([has(SHAPES, false), has([], true), has(SHAPES.slice(1, 2), false)], [true, true, false]);
});

test("a rigidity is in N m, and in N m² for ropes", () => {
  const unit = (part, shapes = SHAPES) => unitOf(row("bending"), shapes, part);
  assert.deepEqual([unit("0"), unit("2"), unit("all"), unit("all", SHAPES.slice(1))], ["N m", "N m²", "N m", "N m²"]);
  assert.equal(unitOf(row("compliance"), SHAPES, "all"), "m/N");
});

test("the bending of a block is its own, or that of all bends, and no command restores that of the scene", () => {
  const values = { bending: 0.5, bending_by_block: [{ block: 2, value: 0.25 }] };
  assert.deepEqual(["all", "0", "2"].map((part) => valueOf(values, "bending", part)), [0.5, 0.5, 0.25]);
  const initial = { bending: null, bending_by_block: [] };
  assert.deepEqual(restoring([row("bending")], values, initial, []), { changes: [], lost: ["Bending"] });
  assert.deepEqual(restoring([row("bending")], { ...values, bending: null }, initial, []), { changes: [], lost: ["Bending"] });
  assert.deepEqual(restoring([row("bending")], initial, initial, []), { changes: [], lost: [] });
});

test("a scene with colliders has rows for their friction and restitution, with a choice of the collider", () => {
  const names = (hasColliders) => rowsOf("xpbd", false, hasColliders).map((row) => row.name);
  for (const name of ["friction", "restitution"]) assert.deepEqual([true, false].map((has) => names(has).includes(name)), [true, false]);
  const colliders = [{ index: 0, shape: "plane", friction: 0.5, restitution: 0 }, { index: 1, shape: "box", friction: 0.25, restitution: 0 }];
  const none = { shapes: [], hasExplicitBends: false };
  assert.deepEqual(partsOf(row("friction"), none, [], colliders), [{ part: "0", text: "0 plane" }, { part: "1", text: "1 box" }]);
  assert.deepEqual(partsOf(row("friction"), none, [], colliders.slice(1)), [], "all is the same");
  const values = withSurfaces({ damping: 1 }, colliders);
  assert.deepEqual(["all", "0", "1"].map((part) => valueOf(values, "friction", part)), [null, 0.5, 0.25]);
  assert.deepEqual(["all", "1"].map((part) => valueOf(values, "restitution", part)), [0, 0]);
  assert.equal(values.damping, 1);
  assert.equal(withSurfaces(null, colliders), null);
  const initial = withSurfaces({ damping: 1 }, [colliders[0], { ...colliders[1], friction: 0.75 }]);
  assert.deepEqual(restoring([row("friction"), row("restitution")], values, initial, []), { changes: [{ name: "friction", value: 0.75, part: "1" }], lost: [] });
});

test("the friction of a message equals that of the scene's text, and what all colliders share is restored at once", () => {
  const ofText = [0, 1, 2].map((index) => ({ index, friction: 0.3, restitution: 0 }));
  const ofMessage = (friction) => ofText.map((one) => ({ ...one, friction: Math.fround(friction) }));
  const restored = (colliders) => restoring([row("friction")], withSurfaces({}, colliders), withSurfaces({}, ofText), []).changes;
  assert.deepEqual(restored(ofMessage(0.3)), []);
  assert.deepEqual(restored(ofMessage(0.7)), [{ name: "friction", value: Math.fround(0.3) }]);
  assert.deepEqual(restored([...ofMessage(0.3).slice(0, 2), ofMessage(0.7)[2]]), [{ name: "friction", value: Math.fround(0.3) }]);
});
