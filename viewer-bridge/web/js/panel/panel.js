// The parameter panel: each row shows the value of the node and sends changes of the user. An older
// answer never moves a slider while the user holds it.

import { valueOf } from "../net/messages.js";
import { KINDS } from "../state/quantity.js";
import { Strokes } from "../tools/tool.js";
import { find, make } from "../ui/dom.js";
import { unitIn } from "../ui/format.js";
import { keyName } from "../ui/keys.js";
import { editable, hasBends, partsOf, positionOf, rangeOf, restoring, rowsOf, SLIDER_STEPS, typedValue, unitOf, valueAt, vectorOf, withSurfaces } from "./parameters.js";

/** @typedef {import("./parameters.js").Row} Row */
/** @typedef {import("../net/messages.js").Values} Values */
/** @typedef {import("../net/messages.js").ParameterValue} ParameterValue */

/** The bends of no scene. @type {import("./parameters.js").Bends} */
const NO_BENDS = { shapes: [], hasExplicitBends: false };
const AXES = ["x", "y", "z"];
/** The parameters of colliders. */
const OF_COLLIDERS = ["friction", "restitution"];
/** Wind drag set along with a wind velocity if there is none, as wind has no effect without drag: the default of scenes, in kg/m³. */
const WIND_DRAG = 0.6;

export class Panel {
  /** @param {HTMLFormElement} form @param {HTMLElement} note @param {import("../tools/tool.js").App} app @param {import("../ui/banner.js").Banner} banner */
  constructor(form, note, { simulation, commands }, banner) {
    this.form = form;
    this.note = note;
    this.simulation = simulation;
    this.commands = commands;
    this.banner = banner;
    this.resetButton = find("parameters-reset", HTMLButtonElement);
    /** Sends the newest unsent value of each parameter and kind. @type {Map<string, () => void>} */
    this.unsent = new Map();
    this.strokes = new Strokes();
    /** Called for Ctrl+Z in a text field. */
    this.onUndo = () => {};
    /** @type {(() => void)[]} */
    this.refreshers = [];
    this.built = "";
    this.surfaces = "";
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("pointerdown", () => this.strokes.press());
    // The pointer may have left the slider.
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) addEventListener(type, () => this.strokes.release());
    this.resetButton.addEventListener("click", () => this.reset());
    for (const topic of /** @type {const} */ (["hello", "node", "parameters", "scene", "connection"])) simulation.on(topic, () => this.update());
    simulation.on("colliders", () => this.followColliders());
  }

  rows() {
    return rowsOf(this.simulation.node?.method ?? null, hasBends(this.simulation.scene ?? NO_BENDS), this.simulation.colliders.length > 0);
  }

  /** Shows another friction or restitution. Colliders arrive in each frame in which one of them moves. */
  followColliders() {
    const surfaces = this.simulation.colliders.map(({ friction, restitution }) => `${friction} ${restitution}`).join();
    if (surfaces === this.surfaces) return;
    this.surfaces = surfaces;
    this.update();
  }

  /** The parameters now or in the scene, with those of its colliders. @param {"values" | "initial"} which @returns {Values | null} */
  all(which) {
    const { parameters, colliders } = this.simulation;
    if (parameters === null || which === "values") return withSurfaces(parameters?.values ?? null, colliders);
    return withSurfaces(parameters.initial, (parameters.initial_colliders ?? []).map((one, index) => ({ index, ...one })));
  }

  /** Rebuilds the rows for another scene or method; otherwise refreshes their values. */
  update() {
    const { simulation } = this;
    const key = `${simulation.scene?.epoch} ${simulation.node?.method} ${simulation.colliders.length}`;
    if (key !== this.built) {
      this.built = key;
      this.refreshers = [];
      this.form.replaceChildren(...this.rows().map((row) => (row.kind === "vector" ? this.vectorRow(row) : this.numberRow(row))));
    }
    const reason = this.reasonAgainst();
    const note = `${reason} ${this.doubt()}`.trim();
    this.note.hidden = note === "";
    this.note.textContent = note;
    // Without a connection the values would be those of the past.
    this.form.hidden = simulation.parameters?.values == null || !simulation.isConnected;
    this.resetButton.hidden = this.form.hidden;
    for (const refresh of this.refreshers) refresh();
    for (const element of this.form.querySelectorAll("fieldset")) element.disabled = reason !== "";
    const { changes, lost } = this.difference();
    this.resetButton.disabled = reason !== "" || changes.length + lost.length === 0;
  }

  /** The parameters that differ from the values of the scene. */
  difference() {
    const [values, initial] = [this.all("values"), this.all("initial")];
    return values === null || initial === null ? { changes: [], lost: [] } : restoring(this.rows(), values, initial, KINDS);
  }

  /** Restores the parameters of the scene, and leaves its particles as they are. */
  reset() {
    const { changes, lost } = this.difference();
    for (const { name, value, part } of changes) this.set(name, value, part);
    if (lost.length > 0) this.banner.notify(`${lost.join(", ")}: each constraint or bend had its own value. Reset the scene to restore them.`, "warning");
  }

  /** The reason why nothing can be set now, or "". */
  reasonAgainst() {
    const { simulation } = this;
    if (!simulation.isConnected) return "There is no connection to the bridge.";
    if (simulation.isRecording) return "The parameters of a recording cannot be changed.";
    if (!simulation.isAlive) return "No node is running.";
    if (simulation.parameters?.values == null) return "No scene is loaded.";
    return "";
  }

  /** The reason why the values may be wrong, or "". */
  doubt() {
    const { parameters } = this.simulation;
    if (parameters?.values == null || parameters.is_complete) return "";
    return "Its parameters cannot be read: these are the values of its scene.";
  }

  /** Sends the parameters that changed since the last animation frame. */
  tick() {
    for (const send of this.unsent.values()) send();
    this.unsent.clear();
  }

  /** @param {string} name @param {ParameterValue} value @param {string} [part] a kind of constraint, a collider or a block */
  set(name, value, part = "all") {
    const index = OF_COLLIDERS.includes(name) ? "collider" : "block";
    const field = KINDS.includes(part) ? { constraint_kind: part } : part === "all" ? {} : { [index]: Number(part) };
    const stroke = this.strokes.ofChange(performance.now());
    this.unsent.set(`${name} ${part}`, () => this.commands.run("set", { parameter: name, value, ...field, stroke }, (outcome) => {
      if (outcome.status !== "applied") this.update();
    }));
  }

  /** The button at the end of a row that restores the value of the scene. @param {Row} row @param {() => void} undo */
  undoButton(row, undo) {
    const text = `Reset ${row.label} to the value of the scene`;
    const button = make("button", { type: "button", class: "undo", title: text, "aria-label": text });
    button.innerHTML = `<svg viewBox="0 0 20 20" aria-hidden="true"><path d="M4.5 6.5A7 7 0 1 1 3.2 11M4 2.5v4.3h4.3"/></svg>`;
    button.addEventListener("click", undo);
    return button;
  }

  /** @param {Row} row @param {string} label @param {(value: number | null) => void} onValue */
  valueField(row, label, onValue) {
    const onWrong = (/** @type {string} */ text) => {
      const allowed = row.kind === "whole" ? "a whole number" : row.canBeOff ? "a number or off" : "a number";
      this.banner.notify(`${row.label}: “${text}” is not ${allowed}.`, "warning");
    };
    return new ValueField(row, label, { onValue, onWrong, onUndo: () => this.onUndo() });
  }

  /** Tells screen readers the value of a slider, instead of its position.
   * @param {HTMLInputElement} slider @param {Row} row @param {ParameterValue} value @param {string} [part] */
  describe(slider, row, value, part) {
    slider.setAttribute("aria-valuetext", `${editable(value)} ${this.unit(row, part)}`.trim());
  }

  /** A row with three sliders and values; a planar scene uses two. @param {Row} row */
  vectorRow(row) {
    const { simulation } = this;
    const read = () => vectorOf(valueOf(simulation.parameters?.values ?? null, row.name, "structural"));
    const initial = () => vectorOf(valueOf(simulation.parameters?.initial ?? null, row.name, "structural"));
    const button = this.undoButton(row, () => this.set(row.name, initial()));
    const range = () => rangeOf(row, ...read(), ...initial());
    const sliders = AXES.map((axis) => make("input", { type: "range", min: 0, max: SLIDER_STEPS, "aria-label": `${row.label} ${axis}` }));
    // The other axes keep their exact values.
    const setAxis = (/** @type {number} */ axis, /** @type {number | null} */ value) => {
      const vector = read();
      vector[axis] = value ?? 0;
      this.set(row.name, vector);
      if (row.name === "wind.velocity" && !valueOf(simulation.parameters?.values ?? null, "wind.drag", "")) this.set("wind.drag", WIND_DRAG);
    };
    const fields = AXES.map((axis, index) => this.valueField(row, `${row.label} ${axis} in ${this.unit(row)}`, (value) => setAxis(index, value)));
    sliders.forEach((slider, axis) => slider.addEventListener("input", () => {
      const value = valueAt(row, range(), slider.valueAsNumber);
      fields[axis].show(value);
      this.describe(slider, row, value);
      setAxis(axis, value);
    }));
    const axes = make("div", { class: "axes all" }, ...AXES.map((axis, index) => make("div", {}, make("span", { "aria-hidden": "true" }, axis), fields[index].input, sliders[index])));
    const shell = make("fieldset", { class: "row" }, make("span", { class: "title wide" }, row.label), make("span", { class: "unit" }, this.unit(row)), button, axes);
    this.refreshers.push(() => {
      const vector = read();
      sliders.forEach((slider, axis) => {
        if (!slider.matches(":active")) slider.valueAsNumber = positionOf(row, range(), vector[axis]);
        this.describe(slider, row, vector[axis]);
        fields[axis].show(vector[axis]);
        slider.disabled = fields[axis].input.disabled = axis === 2 && (simulation.scene?.isPlanar ?? false);
      });
      button.classList.toggle("is-idle", String(vector) === String(initial()));
    });
    return shell;
  }

  /** A row with a slider and its value, a switch if the parameter can be off, and a choice of the part if it has parts. @param {Row} row */
  numberRow(row) {
    const { simulation } = this;
    const slider = make("input", { type: "range", min: 0, max: SLIDER_STEPS, id: `set-${row.name.replace(".", "-")}` });
    const parts = partsOf(row, simulation.scene ?? NO_BENDS, KINDS, simulation.colliders);
    const options = [{ part: "all", text: "all" }, ...parts].map(({ part, text }) => make("option", { value: part }, text));
    const choice = make("select", { "aria-label": `${row.label}: ${row.parts === "kinds" ? "constraint kind" : row.parts === "blocks" ? "shape" : "collider"}` }, ...options);
    const isOn = make("input", { type: "checkbox", "aria-label": `${row.label}: on` });
    const part = () => (parts.length > 0 ? choice.value : "all");
    const read = (/** @type {"values" | "initial"} */ which) => valueOf(this.all(which), row.name, part() === "all" && row.parts !== "colliders" ? "structural" : part());
    const numbers = () => [read("values"), read("initial")].filter((value) => typeof value === "number");
    const range = () => rangeOf(row, .../** @type {number[]} */ (numbers()));
    const send = (/** @type {ParameterValue} */ value) => this.set(row.name, value, part());
    const field = this.valueField(row, `${row.label}${row.unit === "" ? "" : ` in ${this.unit(row)}`}`, send);
    const button = this.undoButton(row, () => send(read("initial")));
    const title = make("span", { class: "title" }, ...(row.canBeOff ? [isOn] : []), make("label", { for: slider.id }, row.label));
    const unit = make("span", { class: "unit" }, this.unit(row));
    const shell = make("fieldset", { class: "row" }, title, parts.length > 0 ? choice : slider, field.input, unit, button, ...(parts.length > 0 ? [slider] : []));
    slider.classList.toggle("all", parts.length > 0);
    const showValue = (/** @type {ParameterValue} */ value) => {
      const isOff = typeof value !== "number" || (row.canBeOff && value === 0 && row.least === 0);
      // Each constraint or bend can have its own value.
      field.show(isOff ? null : value, row.parts === undefined ? "off" : "own");
      this.describe(slider, row, isOff ? null : value, part());
    };
    slider.addEventListener("input", () => {
      const value = valueAt(row, range(), slider.valueAsNumber);
      isOn.checked = true;
      showValue(value);
      send(value);
    });
    isOn.addEventListener("change", () => send(isOn.checked ? row.whenOn ?? row.least : null));
    choice.addEventListener("change", () => this.update());
    this.refreshers.push(() => {
      unit.textContent = this.unit(row, part());
      const value = read("values");
      if (!slider.matches(":active")) slider.valueAsNumber = positionOf(row, range(), typeof value === "number" ? value : row.whenOn ?? row.least);
      // A value of 0 has the same effect as off.
      isOn.checked = value !== null && !(value === 0 && row.least === 0);
      showValue(value);
      // Only a reset restores values that differ between constraints.
      button.classList.toggle("is-idle", String(value) === String(read("initial")) || (read("initial") === null && !row.canBeOff));
    });
    return shell;
  }

  /** The unit of a row for a part, with the length unit of the scene in place of metres. @param {Row} row @param {string} [part] */
  unit(row, part = "all") {
    const { scene } = this.simulation;
    return unitIn(unitOf(row, scene?.shapes ?? [], part), scene?.unit ?? "m");
  }
}

export class ValueField {
  /** @param {Row} row @param {string} label for screen readers @param {{ onValue: (value: number | null) => void, onWrong: (text: string) => void, onUndo: () => void }} on */
  constructor(row, label, { onValue, onWrong, onUndo }) {
    this.input = make("input", { type: "text", inputmode: "decimal", class: "value", "aria-label": label, autocomplete: "off", spellcheck: "false" });
    this.shown = "";
    this.input.addEventListener("focus", () => this.input.select());
    this.input.addEventListener("change", () => {
      const value = typedValue(row, this.input.value);
      if (value !== undefined) return onValue(value);
      onWrong(this.input.value);
      this.input.value = this.shown;
    });
    this.input.addEventListener("keydown", (event) => {
      const { key } = event;
      // The browser's own undo would show an older value than that of the node.
      if ((event.ctrlKey || event.metaKey) && key.toLowerCase() === "z") event.preventDefault();
      if (keyName(event) === "ctrl+z") {
        if (this.input.value === this.shown) onUndo();
        else this.input.value = this.shown;
      }
      // Escape leaves the field without a change.
      if (key === "Escape") this.input.value = this.shown;
      if (key === "Escape" || key === "Enter") this.input.blur();
    });
  }

  /** Shows a value, unless the user is typing another one. @param {ParameterValue} value @param {string} [word] in place of "off" */
  show(value, word = "off") {
    const isTyped = this.input.matches(":focus") && this.input.value !== this.shown;
    this.shown = typeof value === "number" ? editable(value) : word;
    if (!isTyped && this.input.value !== this.shown) this.input.value = this.shown;
  }
}
