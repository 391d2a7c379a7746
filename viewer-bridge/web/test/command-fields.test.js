// Commands by hand.

import assert from "node:assert/strict";
import { test } from "node:test";
import { COMMANDS, messageOf } from "../js/panel/command-fields.js";

test("the example of each field is accepted, and optional fields can be absent", () => {
  for (const [command, fields] of Object.entries(COMMANDS)) {
    const whole = messageOf(command, fields.map(({ example }) => example), 3);
    assert.ok("fields" in whole, command);
    const required = messageOf(command, fields.map(({ example, isOptional }) => (isOptional ? " " : example)), 3);
    if (command !== "cut") assert.deepEqual(Object.keys(required.fields), fields.filter(({ isOptional }) => !isOptional).map(({ name }) => name));
  }
});

test("values are numbers, vectors, texts or off", () => {
  assert.deepEqual(messageOf("push", ["0, 1 ,2.5", "2e-1", "0 0  -1", ""], 3), { fields: { center: [0, 1, 2.5], radius: 0.2, delta: [0, 0, -1] } });
  assert.deepEqual(messageOf("set", ["tear_force", "off", "", "", ""], 3), { fields: { parameter: "tear_force", value: null } });
  assert.deepEqual(messageOf("set", ["gravity", "0 -9.81 0", "", "", ""], 3), { fields: { parameter: "gravity", value: [0, -9.81, 0] } });
  assert.deepEqual(messageOf("set", ["bending", "1e-3", "", "2", ""], 3), { fields: { parameter: "bending", value: 1e-3, block: 2 } });
  assert.deepEqual(messageOf("set", ["friction", "0.3", "", "", "2"], 3), { fields: { parameter: "friction", value: 0.3, collider: 2 } });
  assert.deepEqual(messageOf("cut", ["17"], 3), { fields: { epoch: 3, constraints: [17] } });
  assert.deepEqual(messageOf("pause", [], 3), { fields: {} });
});

test("a wrong value is named with an example", () => {
  const faults = [
    ["pin", [""], "particle: missing (for example 0)"],
    ["pin", ["-1"], 'particle: "-1" is not a whole number up to 4294967295 (for example 0)'],
    ["pin", ["1.5"], 'particle: "1.5" is not a whole number up to 4294967295 (for example 0)'],
    ["pin", ["4294967296"], 'particle: "4294967296" is not a whole number up to 4294967295 (for example 0)'],
    ["step", ["3000000000"], 'count: "3000000000" is not a whole number up to 2147483647 (for example 1)'],
    ["rewind", ["1e20"], 'to_step: "1e20" is not a whole number up to 9007199254740991 (for example 0)'],
    ["cut_radius", ["0 1", "1"], 'center: "0 1" is not 3 numbers (for example 0 1 0)'],
    ["cut_radius", ["0 1 x", "1"], 'center: "0 1 x" is not 3 numbers (for example 0 1 0)'],
    ["cut_radius", ["0 1 0", "wide"], 'radius: "wide" is not a number (for example 0.2)'],
    ["move_anchor", ["0", "0 0 0", "1 0 0", ""], 'rotation: "1 0 0" is not 4 numbers (for example 0 0 0 1)'],
    ["set", ["damping", "1 2", ""], 'value: "1 2" is not a number, three numbers or off (for example 0.5)'],
  ];
  for (const [command, texts, fault] of faults) assert.deepEqual(messageOf(command, texts, 3), { fault });
});
