// The top bar: buttons, scene picker and help, with their keyboard shortcuts.

import { enable, find } from "./dom.js";
import { MODES } from "../tools/input.js";
import { CharacterKeys, listenToKeys, returnFocus } from "./keys.js";
import { askOthers } from "./prompts.js";
import { SceneLoader, SceneMenu, neighbour } from "./scene-menu.js";

/** @typedef {import("../tools/input.js").Mode} Mode */

/** In a smaller window the panel covers much of the picture, so it is hidden at first. */
const PANEL_BESIDE_MIN = "(min-width: 761px) and (min-height: 521px)";
/** Motion of the view per arrow key, in CSS pixels, and zoom factor of the + key. */
const KEY_PIXELS = 30;
const KEY_ZOOM = 1.2;

export class Controls {
  /**
   * @param {import("../tools/tool.js").App} app @param {import("../tools/input.js").Input} input
   * @param {import("./views.js").Views} views @param {{ step(count: number): void, goToMark(direction: number): void }} timeline
   * @param {import("./undo.js").Undo} undo
   */
  constructor(app, input, views, timeline, undo) {
    this.app = app;
    this.input = input;
    this.views = views;
    this.timeline = timeline;
    this.undo = undo;
    this.pause = find("pause", HTMLButtonElement);
    this.step = find("step", HTMLButtonElement);
    this.reset = find("reset", HTMLButtonElement);
    this.scene = find("scene", HTMLButtonElement);
    this.sceneName = find("scene-name", HTMLElement);
    this.menu = new SceneMenu((scene) => this.askToLoad(scene));
    this.help = find("help-dialog", HTMLDialogElement);
    this.modes = [...find("modes", HTMLElement).querySelectorAll("button")];
    this.panelToggle = find("panel-toggle", HTMLButtonElement);
    /** Called for the keys of the inspector. */
    this.onInspect = () => {};
    this.onFollow = () => {};
    /** Called for the key of the picture. */
    this.onPicture = () => {};
    this.listen();
    listenToKeys(this.keymap(), new CharacterKeys());
    returnFocus(input.canvas);
    const { simulation } = app;
    this.loader = new SceneLoader(simulation, app.commands);
    for (const topic of /** @type {const} */ (["hello", "node", "playback", "scene", "parameters", "connection", "past", "undoable"])) simulation.on(topic, () => this.show());
  }

  listen() {
    this.pause.addEventListener("click", () => this.togglePause());
    this.step.addEventListener("click", () => this.stepOnce(1));
    this.reset.addEventListener("click", () => this.askToReset());
    this.scene.addEventListener("click", () => this.openMenu());
    for (const button of this.modes) button.addEventListener("click", () => this.setMode(/** @type {Mode} */ (button.dataset.mode)));
    find("frame", HTMLButtonElement).addEventListener("click", () => this.views.fit());
    find("link", HTMLButtonElement).addEventListener("click", () => this.views.copyLink());
    find("help", HTMLButtonElement).addEventListener("click", () => this.help.showModal());
    this.panelToggle.addEventListener("click", () => this.togglePanel());
    const more = find("more", HTMLButtonElement);
    more.addEventListener("click", () => unfold(more, more.getAttribute("aria-expanded") !== "true"));
    this.input.canvas.addEventListener("pointerdown", () => unfold(more, false));
    this.help.addEventListener("click", (event) => { if (event.target === this.help) this.help.close(); });
    if (!matchMedia(PANEL_BESIDE_MIN).matches) this.togglePanel();
  }

  /** @returns {import("./keys.js").Keymap} */
  keymap() {
    const { views, app } = this;
    /** @type {import("./keys.js").Keymap} */
    const keymap = {
      " ": () => this.togglePause(),
      ".": () => (app.simulation.isLookingBack ? this.timeline.step(1) : this.stepOnce(1)),
      ",": () => this.timeline.step(-1),
      "<": () => this.timeline.goToMark(-1),
      ">": () => this.timeline.goToMark(1),
      r: () => { if (!this.reset.disabled) this.askToReset(); },
      "ctrl+z": () => this.undo.run(),
      f: () => views.fit(),
      s: () => this.onPicture(),
      v: () => this.togglePanel(),
      h: () => views.toggle("heat"),
      e: () => views.toggle("sticks"),
      k: () => views.toggle("particles"),
      n: () => views.toggle("forces"),
      x: () => views.toggle("effects"),
      g: () => this.setMode("grab"),
      b: () => this.setMode("brush"),
      c: () => this.setMode("cut"),
      p: () => { if (!this.input.pinByKey()) this.setMode("pin"); },
      m: () => this.openMenu(),
      "[": () => this.loadNeighbour(-1),
      "]": () => this.loadNeighbour(1),
      "?": () => this.help.showModal(),
      "+": () => this.zoom(KEY_ZOOM),
      "=": () => this.zoom(KEY_ZOOM),
      "-": () => this.zoom(1 / KEY_ZOOM),
      ArrowLeft: () => this.arrow(-1, 0),
      ArrowRight: () => this.arrow(1, 0),
      ArrowUp: () => this.arrow(0, -1),
      ArrowDown: () => this.arrow(0, 1),
      i: () => this.onInspect(),
      t: () => this.onFollow(),
      Escape: () => this.escape(),
    };
    for (let digit = 1; digit <= 9; digit++) keymap[digit] = () => this.openMenu(this.scenes()[digit - 1]?.name);
    return keymap;
  }

  /** @param {number} x @param {number} y */
  arrow(x, y) {
    const { camera, renderer, simulation } = this.app;
    if ((simulation.isReplay || simulation.isLookingBack) && x !== 0) return this.timeline.step(x);
    if (camera.isFlat) camera.pan(-x * KEY_PIXELS, -y * KEY_PIXELS, renderer.viewport);
    else camera.orbit(-x * KEY_PIXELS, -y * KEY_PIXELS);
    renderer.isDirty = true;
  }

  /** @param {number} factor */
  zoom(factor) {
    const { camera, renderer } = this.app;
    camera.zoom(factor, renderer.viewport.width / 2, renderer.viewport.height / 2, renderer.viewport);
    renderer.isDirty = true;
  }

  /** Ends what is going on: a look back, or else the tool in use and the selection. */
  escape() {
    const { simulation, selection } = this.app;
    if (simulation.isLookingBack) return simulation.returnToPresent();
    this.input.finish();
    selection.clear();
  }

  togglePause() {
    if (this.pause.disabled) return;
    this.app.commands.run(this.app.simulation.isPaused ? "resume" : "pause");
  }

  /** Makes one step; pauses a running simulation first. @param {number} count */
  stepOnce(count) {
    if (this.step.disabled) return;
    if (this.app.simulation.isReplay) return this.timeline.step(count);
    if (!this.app.simulation.isPaused) this.app.commands.run("pause");
    this.app.commands.run("step", { count });
  }

  /** @param {string} scene */
  load(scene) {
    this.loader.load(scene);
  }

  /** The name of the scene on show. */
  name() {
    const { node, scene, timeline } = this.app.simulation;
    return scene?.name || (node?.scene ?? timeline?.scene ?? null);
  }

  scenes() {
    return this.app.simulation.hello?.scenes ?? [];
  }

  /** Opens the menu of scenes at a card: at that of the present scene without a name. @param {string} [name] */
  openMenu(name) {
    if (!this.scene.disabled) this.menu.open(this.scenes(), this.name(), name);
  }

  /** Loads the scene before or after the present one in the list. @param {number} by */
  loadNeighbour(by) {
    const scene = neighbour(this.scenes(), this.loader.requested ?? this.name(), by);
    if (scene !== undefined && !this.scene.disabled) this.askToLoad(scene.name);
  }

  /** Loads a scene. Asks first if other pages show the present one. @param {string} scene */
  askToLoad(scene) {
    const words = { effect: `Loading “${scene}” replaces it for everybody.`, yes: `Load ${scene}`, no: `Keep ${this.name() ?? "it"}` };
    askOthers(this.app.simulation, words, () => this.load(scene));
  }

  /** Resets the scene. Asks first if other pages show it. */
  askToReset() {
    const words = { effect: "A reset puts it back to its start for everybody.", yes: "Reset", no: "Keep it" };
    askOthers(this.app.simulation, words, () => this.app.commands.run("reset"));
  }

  /** @param {Mode} mode */
  setMode(mode) {
    if (!this.canChange() || !MODES.includes(mode)) return;
    this.input.mode = mode;
    this.input.isHoverStale = true;
    this.input.canvas.dataset.cursor = mode;
    for (const button of this.modes) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
    this.input.onMode();
  }

  togglePanel() {
    const isAway = document.body.classList.toggle("panel-away");
    this.panelToggle.setAttribute("aria-pressed", String(!isAway));
  }

  canChange() {
    const { simulation } = this.app;
    return simulation.isAlive && !simulation.isRecording && !simulation.isLookingBack;
  }

  /** Updates the controls. The tooltip of a disabled control gives the reason. */
  show() {
    const { simulation } = this.app;
    const gone = simulation.isAlive ? "" : simulation.isConnected ? "No node is running." : "There is no connection to the bridge.";
    const past = gone || (simulation.isLookingBack ? "You are looking at an earlier state. Return to the present first (Esc)." : "");
    const recorded = (/** @type {string} */ reason) => past || (simulation.isRecording ? reason : "");
    const isPaused = simulation.isPaused && gone === "";
    this.pause.setAttribute("aria-pressed", String(isPaused));
    setText(this.pause, isPaused ? "Resume" : "Pause");
    enable(this.pause, gone);
    enable(this.step, past);
    enable(this.reset, recorded("A recording cannot be reset. Use the timeline to go back."));
    enable(this.undo.button, recorded("A recording has nothing to undo.") || this.undo.reasonAgainst());
    for (const button of this.modes) enable(button, recorded("A recording cannot be changed."));
    this.sceneName.textContent = this.name() ?? "No scene";
    this.scene.value = this.name() ?? "";
    enable(this.scene, recorded("A recording has one scene."));
    // A menu that cannot load anything closes.
    if (this.scene.disabled) this.menu.dialog.close();
  }
}

/** Shows the controls that small screens fold away, or folds them. @param {HTMLButtonElement} more @param {boolean} isOn */
function unfold(more, isOn) {
  more.setAttribute("aria-expanded", String(isOn));
  document.body.classList.toggle("is-unfolded", isOn);
}

/** @param {HTMLButtonElement} button @param {string} text */
function setText(button, text) {
  const label = button.querySelector("span");
  if (label !== null && label.textContent !== text) label.textContent = text;
}
