// The inspector: what is known of the selected particles and constraints. Its elements are built when the
// selection changes, and their texts change ten times a second at most. An empty selection costs nothing.

import { find, make } from "../ui/dom.js";
import { readable, trim, sceneUnits } from "../ui/format.js";
import { PIN } from "../net/wire.js";
import { distanceOf, holderOf, inspectConstraint, inspectParticle } from "../state/inspection.js";
import { ITEM_COLORS, constraintsAt, nameOf, parseItems } from "../state/selection.js";
import { particleAt } from "../tools/tool.js";
import { add, length, scale, subtract } from "../geometry/math.js";

/** @typedef {import("../state/selection.js").Item} Item */
/** @typedef {import("../geometry/math.js").Vec3} Vec3 */

const INTERVAL_MS = 100;
/** Constraints of a particle that are listed. */
const LISTED_MAX = 8;
/** Digits of a coordinate: those of a 32-bit number. */
const DIGITS = 6;

export class Inspector {
  /** @param {import("../tools/tool.js").App} app @param {import("../tools/input.js").Input} input @param {import("../ui/banner.js").Banner} banner */
  constructor(app, input, banner) {
    this.app = app;
    this.input = input;
    this.banner = banner;
    this.list = find("inspected", HTMLElement);
    this.hint = find("inspect-hint", HTMLElement);
    this.field = find("inspect", HTMLInputElement);
    this.follow = find("follow", HTMLInputElement);
    this.tools = find("inspect-tools", HTMLElement);
    this.said = find("inspect-said", HTMLElement);
    this.updatedMs = 0;
    /** Writes the values of the items. @type {(() => void)[]} */
    this.refreshers = [];
    /** The masses of particles that something holds, as last seen. @type {Map<number, number>} */
    this.masses = new Map();
    /** Where the selection was in the last frame that the camera followed. @type {Vec3 | null} */
    this.followed = null;
    this.field.addEventListener("change", () => this.read());
    this.field.addEventListener("keydown", ({ key }) => {
      // Leaving the field reads it.
      if (key === "Escape") this.field.value = app.selection.items.map(nameOf).join(", ");
      if (key === "Escape" || key === "Enter") input.canvas.focus({ preventScroll: true });
    });
    find("inspect-clear", HTMLButtonElement).addEventListener("click", () => app.selection.clear());
    this.follow.addEventListener("change", () => this.setFollow(this.follow.checked));
    app.selection.on("change", () => this.build());
    app.simulation.on("scene", () => this.masses.clear());
    app.simulation.on("frame", () => this.moveCamera());
    input.canvas.addEventListener("keydown", (event) => this.onTab(event));
  }

  /** With a selection, Tab goes to the next item and Shift Tab to the previous one. Escape ends the selection, and
   * Tab leaves the picture again. @param {KeyboardEvent} event */
  onTab(event) {
    if (event.key !== "Tab" || event.ctrlKey || event.altKey || event.metaKey || this.app.selection.items.length === 0) return;
    event.preventDefault();
    this.app.selection.step(event.shiftKey ? -1 : 1);
  }

  /** Selects the particle in the middle of the picture; then a constraint at it, and one of its ends. */
  turn() {
    const { selection, renderer } = this.app;
    if (selection.items.length > 0) return selection.turn();
    const { width, height } = renderer.viewport;
    const particle = particleAt(this.app, { x: width / 2, y: height / 2 }, Math.max(width, height));
    if (particle !== null) selection.set([{ kind: "particle", index: particle }]);
    this.input.canvas.focus({ preventScroll: true });
  }

  toggleFollow() {
    if (this.app.selection.items.length === 0) return;
    this.setFollow(!this.app.selection.isFollowed);
  }

  /** @param {boolean} isOn */
  setFollow(isOn) {
    this.follow.checked = this.app.selection.isFollowed = isOn;
    this.followed = null;
    this.moveCamera();
    this.app.renderer.isDirty = true;
  }

  /** Selects what the user has typed. */
  read() {
    const { scene } = this.app.simulation;
    if (scene === null) return;
    const items = parseItems(this.field.value, scene);
    if (typeof items === "string") return this.banner.notify(items, "warning");
    this.app.selection.set(items);
  }

  /** Moves the view along with the middle of the selection. */
  moveCamera() {
    const { selection, simulation, camera } = this.app;
    if (!selection.isFollowed || selection.particles.length === 0) return;
    const places = selection.particles.map((one) => simulation.position(one)).filter((one) => one !== null);
    if (places.length === 0) return;
    const middle = scale(places.reduce(add), 1 / places.length);
    camera.target = this.followed === null ? middle : add(camera.target, subtract(middle, this.followed));
    this.followed = middle;
  }

  /** True if the forces on the selected particles are published: something holds one. */
  wantsForces() {
    const { selection, simulation } = this.app;
    const held = PIN.pinned | PIN.grabbed | PIN.anchored;
    return selection.items.some(({ kind, index }) => kind === "particle" && ((simulation.pins.get(index) ?? 0) & held) !== 0);
  }

  build() {
    const { selection } = this.app;
    const { items } = selection;
    this.refreshers = [];
    const isEmpty = items.length === 0;
    this.hint.hidden = !isEmpty;
    this.tools.hidden = isEmpty;
    this.setFollow(selection.isFollowed && !isEmpty);
    if (!this.field.matches(":focus")) this.field.value = items.map(nameOf).join(", ");
    this.list.replaceChildren(...items.map((item, place) => this.section(item, place)), ...this.distance(items));
    this.said.textContent = isEmpty ? "" : `Selected: ${items.map(({ kind, index }) => `${kind} ${index}`).join(", ")}`;
    this.refresh();
  }

  /** @param {number} nowMs */
  tick(nowMs) {
    if (this.refreshers.length === 0 || nowMs - this.updatedMs < INTERVAL_MS) return;
    this.updatedMs = nowMs;
    this.refresh();
  }

  refresh() {
    for (const refresh of this.refreshers) refresh();
  }

  /** @param {Item} item @param {number} place */
  section(item, place) {
    const swatch = make("i", { "aria-hidden": "true" });
    swatch.style.background = ITEM_COLORS[place];
    const title = make("h3", {}, swatch, item.kind === "particle" ? `Particle ${item.index}` : `Constraint ${item.index}`);
    const rows = make("dl", { class: "figures" });
    this.refreshers.push(item.kind === "particle" ? this.particleRows(rows, item.index) : this.constraintRows(rows, item.index));
    return make("section", { class: "item" }, title, rows);
  }

  /** @param {HTMLElement} list @param {number} particle */
  particleRows(list, particle) {
    const { simulation } = this.app;
    const row = rowsIn(list);
    const [position, speed, velocity, mass, holder, force] = ["Position", "Speed", "Velocity", "Mass", "Held by", "Force of its constraints"].map(row);
    const scene = /** @type {import("../net/wire.js").Scene} */ (simulation.scene);
    const joined = constraintsAt(scene, particle, LISTED_MAX + 1);
    const links = joined.slice(0, LISTED_MAX).map((index) => this.link({ kind: "constraint", index }));
    row("Constraints").append(...(links.length === 0 ? ["none"] : links), joined.length > LISTED_MAX ? " …" : "");
    return () => {
      const units = sceneUnits(simulation.scene);
      const values = inspectParticle(simulation, particle);
      if (values === null) return;
      setText(position, vectorText(values.position, units.length));
      setText(speed, readable(values.speed, units.speed));
      setText(velocity, values.velocity === null ? "–" : vectorText(values.velocity, units.speed));
      setText(mass, this.massText(particle, values.inverseMass));
      setText(holder, holderOf(values.flags, this.input.grabbed === particle && !this.input.isRefused));
      const isHeld = (values.flags & (PIN.pinned | PIN.grabbed | PIN.anchored)) !== 0;
      const shown = values.force === null ? absence(simulation) : `${readable(length(values.force), units.force)} (${values.force.map(trim).join(", ")})`;
      setText(force, isHeld ? shown : "–");
    };
  }

  /** A particle that something holds has no inverse mass, so its mass is that of the last time it was free.
   * @param {number} particle @param {number | null} inverse */
  massText(particle, inverse) {
    if (inverse !== null && inverse > 0) this.masses.set(particle, 1 / inverse);
    const mass = this.masses.get(particle);
    if (mass !== undefined) return `${trim(mass)} kg`;
    return inverse === null ? "–" : "not published while it is held";
  }

  /** @param {HTMLElement} list @param {number} constraint */
  constraintRows(list, constraint) {
    const { simulation } = this.app;
    const row = rowsIn(list);
    const ends = row("Ends");
    const [kind, long, rest, strain, compliance, tension, state] = ["Kind", "Length", "Rest length", "Strain", "Compliance", "Tension", "State"].map(row);
    const known = inspectConstraint(simulation, constraint);
    ends.append(...(known?.ends ?? []).map((index) => this.link({ kind: "particle", index })));
    return () => {
      const units = sceneUnits(simulation.scene);
      const values = inspectConstraint(simulation, constraint);
      if (values === null) return;
      const isTorn = values.cause !== null;
      setText(kind, values.kind);
      setText(long, `${precise(values.length)} ${units.length}`);
      setText(rest, `${precise(values.restLength)} ${units.length}`);
      setText(strain, isTorn ? "– (torn)" : readable(values.strain, "%"));
      setText(compliance, values.compliance === null ? "– (pbd)" : values.isRigid ? "0: rigid" : `${trim(values.compliance)} ${units.compliance}`);
      const unknown = isTorn ? "0: torn" : values.isRigid ? "not known: rigid" : "not defined in pbd";
      setText(tension, values.tension === null ? unknown : readable(values.tension, units.force));
      setText(state, isTorn ? `torn: ${values.cause}` : "intact");
    };
  }

  /** The distance of two particles. @param {Item[]} items */
  distance(items) {
    if (items.length !== 2 || items.some(({ kind }) => kind !== "particle")) return [];
    const { simulation } = this.app;
    const rows = make("dl", { class: "figures" });
    const value = rowsIn(rows)("Distance");
    const [a, b] = items;
    this.refreshers.push(() => {
      const apart = distanceOf(simulation, a.index, b.index);
      setText(value, apart === null ? "–" : `${precise(apart)} ${sceneUnits(simulation.scene).length}`);
    });
    return [make("section", { class: "item", id: "distance" }, rows)];
  }

  /** A button that selects an item. @param {Item} item */
  link(item) {
    const button = make("button", { type: "button", class: "link", "aria-label": `Select ${item.kind} ${item.index}` }, nameOf(item));
    button.addEventListener("click", () => this.app.selection.set([item]));
    return button;
  }
}

/** Returns a function that adds a row to a list, and returns the element of its value. @param {HTMLElement} list */
function rowsIn(list) {
  return (/** @type {string} */ name) => {
    const value = make("dd");
    list.append(make("dt", {}, name), value);
    return value;
  };
}

/** Says why there is no force. @param {import("../state/simulation.js").Simulation} simulation */
function absence({ isReplay, isPaused, forces }) {
  if (forces !== null) return "none published";
  if (isReplay) return "none recorded of this step";
  return isPaused ? "after the next step" : "waiting";
}

/** @param {number} value */
const precise = (value) => String(Number(value.toPrecision(DIGITS)));

/** @param {Vec3} vector @param {string} unit */
const vectorText = (vector, unit) => `${vector.map((one) => trimmed(one)).join(", ")} ${unit}`;
/** @param {number} value */
const trimmed = (value) => (Math.abs(value) < 1e-6 ? "0" : Math.abs(value) >= 1e5 ? value.toPrecision(DIGITS) : value.toFixed(4));

/** @param {Element} element @param {string} text */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
