// Commands by hand.

import assert from "node:assert/strict";
import { test } from "node:test";
import { exampleOf, fieldsOf } from "../js/panel/command-form.js";
import { ACTIONS } from "../js/panel/tables.js";

test("the example of each field is accepted, and optional fields can be absent", () => {
  for (const [kind, fields] of Object.entries(ACTIONS)) {
    assert.ok(fields.every((field) => exampleOf(field) !== undefined), kind);
    const whole = fieldsOf(kind, fields.map(exampleOf));
    assert.deepEqual(Object.keys(whole.fields), fields.map(({ name }) => name));
    const required = fieldsOf(kind, fields.map((field) => (field.isOptional ? " " : exampleOf(field))));
    assert.deepEqual(Object.keys(required.fields), fields.filter(({ isOptional }) => !isOptional).map(({ name }) => name));
  }
});

test("values are numbers, vectors, texts or off", () => {
  assert.deepEqual(fieldsOf("push", ["0, 1 ,2.5", "2e-1", "0 0  -1", ""]), { fields: { center: [0, 1, 2.5], radius: 0.2, delta: [0, 0, -1] } });
  assert.deepEqual(fieldsOf("set", ["tear_force", "off", "", "", ""]), { fields: { parameter: "tear_force", value: null } });
  assert.deepEqual(fieldsOf("set", ["gravity", "0 -9.81 0", "", "", ""]), { fields: { parameter: "gravity", value: [0, -9.81, 0] } });
  assert.deepEqual(fieldsOf("set", ["bending", "1e-3", "", "2", ""]), { fields: { parameter: "bending", value: 1e-3, block: 2 } });
  assert.deepEqual(fieldsOf("set", ["friction", "0.3", "", "", "2"]), { fields: { parameter: "friction", value: 0.3, collider: 2 } });
  assert.deepEqual(fieldsOf("cut", ["17"]), { fields: { constraint: 17 } });
  assert.deepEqual(fieldsOf("pause", []), { fields: {} });
});

test("a wrong value is named with an example", () => {
  const faults = [
    ["pin", [""], "particle: missing (for example 0)"],
    ["pin", ["-1"], 'particle: "-1" is not a whole number up to 4294967295 (for example 0)'],
    ["pin", ["1.5"], 'particle: "1.5" is not a whole number up to 4294967295 (for example 0)'],
    ["pin", ["4294967296"], 'particle: "4294967296" is not a whole number up to 4294967295 (for example 0)'],
    ["step", ["5000000000"], 'count: "5000000000" is not a whole number up to 4294967295 (for example 1)'],
    ["rewind", ["1e20", ""], 'to_step: "1e20" is not a whole number up to 9007199254740991 (for example 0)'],
    ["cut_radius", ["0 1", "1"], 'center: "0 1" is not 3 numbers (for example 0 1 0)'],
    ["cut_radius", ["0 1 x", "1"], 'center: "0 1 x" is not 3 numbers (for example 0 1 0)'],
    ["cut_radius", ["0 1 0", "wide"], 'radius: "wide" is not a number (for example 0.2)'],
    ["move_anchor", ["0", "0 0 0", "1 0 0", ""], 'rotation: "1 0 0" is not 4 numbers (for example 0 0 0 1)'],
    ["mark", ["ü".repeat(81)], `text: "${"ü".repeat(81)}" is not a text of at most 160 bytes (for example it slips)`],
    ["set", ["damping", "1 2", ""], 'value: "1 2" is not a number, three numbers or off (for example 0.5)'],
  ];
  for (const [command, texts, fault] of faults) assert.deepEqual(fieldsOf(command, texts), { fault });
});
