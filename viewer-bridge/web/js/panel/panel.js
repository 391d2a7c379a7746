// The parameter panel: each row shows the value of the node and sends changes of the user. An older
// answer never moves a slider while the user holds it.

import { make } from "../ui/dom.js";
import { SLIDER_STEPS, positionOf, rangeOf, rowsOf, valueAt, valueOf, vectorOf } from "./parameters.js";
import { trim } from "../ui/format.js";

/** @typedef {import("./parameters.js").Row} Row */
/** @typedef {import("../net/messages.js").ParameterValue} ParameterValue */

const KINDS = ["structural", "shear", "bend", "tether"];
const AXES = ["x", "y", "z"];
/** Wind drag set along with a wind velocity if there is none, as wind has no effect without drag: the default of scenes, in kg/m³. */
const WIND_DRAG = 0.6;

export class Panel {
  /** @param {HTMLFormElement} form @param {HTMLElement} note @param {import("../state/simulation.js").Simulation} simulation @param {import("../net/commands.js").Commands} commands */
  constructor(form, note, simulation, commands) {
    this.form = form;
    this.note = note;
    this.simulation = simulation;
    this.commands = commands;
    /** Sends the newest unsent value of each parameter. @type {Map<string, () => void>} */
    this.unsent = new Map();
    /** @type {(() => void)[]} */
    this.refreshers = [];
    this.built = "";
    form.addEventListener("submit", (event) => event.preventDefault());
    for (const topic of /** @type {const} */ (["hello", "node", "parameters", "scene"])) simulation.on(topic, () => this.update());
  }

  /** Rebuilds the rows for another scene or method; otherwise refreshes their values. */
  update() {
    const { simulation } = this;
    const key = `${simulation.scene?.epoch} ${simulation.node?.method}`;
    if (key !== this.built) {
      this.built = key;
      this.refreshers = [];
      this.form.replaceChildren(...rowsOf(simulation.node?.method ?? null).map((row) => (row.kind === "vector" ? this.vectorRow(row) : this.numberRow(row))));
    }
    const reason = this.reasonAgainst();
    const note = `${reason} ${this.doubt()}`.trim();
    this.note.hidden = note === "";
    this.note.textContent = note;
    this.form.hidden = simulation.parameters?.values == null;
    for (const refresh of this.refreshers) refresh();
    for (const element of this.form.querySelectorAll("fieldset")) element.disabled = reason !== "";
  }

  /** The reason why nothing can be set now, or "". */
  reasonAgainst() {
    const { simulation } = this;
    if (simulation.isReplay || simulation.node?.is_replay) return "The parameters of a recording cannot be changed.";
    if (simulation.parameters?.values == null) return "No scene is loaded.";
    return "";
  }

  /** The reason why the values may be wrong, or "". */
  doubt() {
    const { parameters } = this.simulation;
    if (parameters?.values == null || parameters.is_complete) return "";
    return "It has an older format without parameters: these are the values of its scene.";
  }

  /** Sends the parameters that changed since the last animation frame. */
  tick() {
    for (const send of this.unsent.values()) send();
    this.unsent.clear();
  }

  /** @param {string} name @param {ParameterValue} value @param {string} [kind] */
  set(name, value, kind) {
    const forKind = kind === undefined || kind === "all" ? {} : { constraint_kind: kind };
    this.unsent.set(name, () => this.commands.run("set", { parameter: name, value, ...forKind }, (outcome) => {
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

  /** A row with three sliders; a planar scene uses two. @param {Row} row */
  vectorRow(row) {
    const { simulation } = this;
    const output = make("output");
    const read = () => vectorOf(valueOf(simulation.parameters?.values ?? null, row.name, "structural"));
    const initial = () => vectorOf(valueOf(simulation.parameters?.initial ?? null, row.name, "structural"));
    const button = this.undoButton(row, () => this.set(row.name, initial()));
    const range = () => rangeOf(row, ...read(), ...initial());
    const sliders = AXES.map((axis) => make("input", { type: "range", min: 0, max: SLIDER_STEPS, "aria-label": `${row.label} ${axis}` }));
    const shown = () => /** @type {[number, number, number]} */ (sliders.map((slider) => valueAt(row, range(), slider.valueAsNumber)));
    const showValue = (/** @type {number[]} */ vector) => { output.textContent = `${vector.map(trim).join(", ")} ${this.unit(row)}`; };
    sliders.forEach((slider, axis) => slider.addEventListener("input", () => {
      // The other axes keep their exact values.
      const vector = read();
      vector[axis] = shown()[axis];
      showValue(vector);
      this.set(row.name, vector);
      if (row.name === "wind_velocity" && !valueOf(simulation.parameters?.values ?? null, "wind_drag", "")) this.set("wind_drag", WIND_DRAG);
    }));
    const axes = make("div", { class: "axes all" }, ...sliders.map((slider, axis) => make("label", {}, AXES[axis], slider)));
    const shell = make("fieldset", { class: "row" }, make("span", { class: "title wide" }, row.label), output, button, axes);
    this.refreshers.push(() => {
      const vector = read();
      sliders.forEach((slider, axis) => {
        if (!slider.matches(":active")) slider.valueAsNumber = positionOf(row, range(), vector[axis]);
        slider.disabled = axis === 2 && (simulation.scene?.isPlanar ?? false);
      });
      showValue(vector);
      button.classList.toggle("is-idle", String(vector) === String(initial()));
    });
    return shell;
  }

  /** A row with one slider, a switch if the parameter can be off, and a choice of the constraint kind if it is per kind. @param {Row} row */
  numberRow(row) {
    const { simulation } = this;
    const output = make("output");
    const slider = make("input", { type: "range", min: 0, max: SLIDER_STEPS, id: `set-${row.name}` });
    const kinds = make("select", { "aria-label": `${row.label}: constraint kind` }, ...["all", ...KINDS].map((kind) => make("option", {}, kind)));
    const isOn = make("input", { type: "checkbox", "aria-label": `${row.label}: on` });
    const kind = () => (row.perKind ? kinds.value : "all");
    const read = (/** @type {"values" | "initial"} */ which) => valueOf(simulation.parameters?.[which] ?? null, row.name, kind() === "all" ? "structural" : kind());
    const numbers = () => [read("values"), read("initial")].filter((value) => typeof value === "number");
    const range = () => rangeOf(row, .../** @type {number[]} */ (numbers()));
    const send = (/** @type {ParameterValue} */ value) => this.set(row.name, value, row.perKind ? kind() : undefined);
    const button = this.undoButton(row, () => send(read("initial")));
    const title = make("span", { class: "title" }, ...(row.canBeOff ? [isOn] : []), make("label", { for: slider.id }, row.label));
    const shell = make("fieldset", { class: "row" }, title, slider, output, button);
    if (row.perKind) slider.before(kinds);
    if (row.perKind) shell.append(slider);
    slider.classList.toggle("all", row.perKind ?? false);
    const showValue = (/** @type {ParameterValue} */ value) => { output.textContent = typeof value === "number" && !(row.canBeOff && value === 0 && row.least === 0) ? `${trim(value)} ${this.unit(row)}` : row.perKind ? "own" : "off"; };
    slider.addEventListener("input", () => {
      const value = valueAt(row, range(), slider.valueAsNumber);
      isOn.checked = true;
      showValue(value);
      send(value);
    });
    isOn.addEventListener("change", () => send(isOn.checked ? row.whenOn ?? row.least : null));
    kinds.addEventListener("change", () => this.update());
    this.refreshers.push(() => {
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

  /** The unit of a row, with the length unit of the scene in place of metres. @param {Row} row */
  unit(row) {
    const length = this.simulation.scene?.unit ?? "m";
    return length === "m" ? row.unit : row.unit.replace(/^m\b/, length);
  }
}
