// The top bar: buttons, scene picker and help, with their keyboard shortcuts.

import { find, make } from "./dom.js";
import { MODES } from "../tools/input.js";
import { listenToKeys } from "./keys.js";

/** @typedef {import("../tools/input.js").Mode} Mode */

/** Below this width the panel covers the picture, so it is hidden at first. */
const PANEL_BESIDE_MIN = "(min-width: 761px)";
/** Motion of the view per arrow key, in CSS pixels, and zoom factor of the + key. */
const KEY_PIXELS = 30;
const KEY_ZOOM = 1.2;

export class Controls {
  /**
   * @param {import("../tools/tool.js").App} app @param {import("../tools/input.js").Input} input
   * @param {import("./views.js").Views} views @param {import("./timeline-bar.js").TimelineBar} timeline
   * @param {import("./banner.js").Banner} banner
   */
  constructor(app, input, views, timeline, banner) {
    this.app = app;
    this.input = input;
    this.views = views;
    this.timeline = timeline;
    this.banner = banner;
    this.pause = find("pause", HTMLButtonElement);
    this.step = find("step", HTMLButtonElement);
    this.reset = find("reset", HTMLButtonElement);
    this.scene = find("scene", HTMLSelectElement);
    this.help = find("help-dialog", HTMLDialogElement);
    this.modes = [...find("modes", HTMLElement).querySelectorAll("button")];
    this.panelToggle = find("panel-toggle", HTMLButtonElement);
    this.listen();
    listenToKeys(this.keymap());
    const { simulation } = app;
    for (const topic of /** @type {const} */ (["hello", "node", "playback", "scene", "parameters"])) simulation.on(topic, () => this.show());
  }

  listen() {
    this.pause.addEventListener("click", () => this.togglePause());
    this.step.addEventListener("click", () => this.stepOnce(1));
    this.reset.addEventListener("click", () => this.app.commands.run("reset"));
    this.scene.addEventListener("change", () => this.load(this.scene.value));
    for (const button of this.modes) button.addEventListener("click", () => this.setMode(/** @type {Mode} */ (button.dataset.mode)));
    find("frame", HTMLButtonElement).addEventListener("click", () => this.views.frame());
    find("picture", HTMLButtonElement).addEventListener("click", () => this.views.savePicture());
    find("link", HTMLButtonElement).addEventListener("click", () => this.views.copyLink());
    find("help", HTMLButtonElement).addEventListener("click", () => this.help.showModal());
    this.panelToggle.addEventListener("click", () => this.togglePanel());
    this.help.addEventListener("click", (event) => { if (event.target === this.help) this.help.close(); });
    if (!matchMedia(PANEL_BESIDE_MIN).matches) this.togglePanel();
  }

  /** @returns {import("./keys.js").Keymap} */
  keymap() {
    const { views, app } = this;
    /** @type {import("./keys.js").Keymap} */
    const keymap = {
      " ": () => this.togglePause(),
      ".": () => this.stepOnce(1),
      ",": () => { if (app.simulation.isReplay) this.stepOnce(-1); },
      r: () => { if (!this.reset.disabled) app.commands.run("reset"); },
      f: () => views.frame(),
      s: () => views.savePicture(),
      v: () => this.togglePanel(),
      h: () => views.toggle("heat"),
      l: () => views.toggle("sticks"),
      k: () => views.toggle("particles"),
      g: () => this.setMode("grab"),
      b: () => this.setMode("brush"),
      c: () => this.setMode("cut"),
      p: () => { if (!this.input.pinHovered()) this.setMode("pin"); },
      "?": () => this.help.showModal(),
      "+": () => this.zoom(KEY_ZOOM),
      "=": () => this.zoom(KEY_ZOOM),
      "-": () => this.zoom(1 / KEY_ZOOM),
      ArrowLeft: () => this.arrow(-1, 0),
      ArrowRight: () => this.arrow(1, 0),
      ArrowUp: () => this.arrow(0, -1),
      ArrowDown: () => this.arrow(0, 1),
      Escape: () => this.input.finish(),
    };
    for (let digit = 1; digit <= 9; digit++) keymap[digit] = () => this.loadNumber(digit - 1);
    return keymap;
  }

  /** @param {number} x @param {number} y */
  arrow(x, y) {
    const { camera, renderer, simulation } = this.app;
    if (simulation.isReplay && x !== 0) return this.stepOnce(x);
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
    this.app.commands.run("load", { scene }, (outcome) => {
      if (outcome.status !== "applied") this.show();
    });
  }

  /** @param {number} index */
  loadNumber(index) {
    const scene = this.app.simulation.hello?.scenes[index];
    if (scene !== undefined && !this.scene.disabled) this.load(scene.name);
  }

  /** @param {Mode} mode */
  setMode(mode) {
    if (!this.canChange() || !MODES.includes(mode)) return;
    this.input.mode = mode;
    this.input.isHoverStale = true;
    this.input.canvas.dataset.cursor = mode;
    for (const button of this.modes) button.setAttribute("aria-pressed", String(button.dataset.mode === mode));
  }

  togglePanel() {
    const isAway = document.body.classList.toggle("panel-away");
    this.panelToggle.setAttribute("aria-pressed", String(!isAway));
  }

  canChange() {
    const { simulation } = this.app;
    return !simulation.isReplay && !(simulation.node?.is_replay ?? false) && simulation.node?.state === "alive";
  }

  /** Updates the controls. The tooltip of a disabled control gives the reason. */
  show() {
    const { simulation } = this.app;
    const isAlive = simulation.node?.state === "alive" || simulation.isReplay;
    const isRecording = simulation.isReplay || (simulation.node?.is_replay ?? false);
    this.pause.setAttribute("aria-pressed", String(simulation.isPaused));
    setText(this.pause, simulation.isPaused ? "Resume" : "Pause");
    enable(this.pause, isAlive, "No node is running.");
    enable(this.step, isAlive, "No node is running.");
    enable(this.reset, isAlive && !isRecording, isRecording ? "A recording cannot be reset. Use the timeline to go back." : "No node is running.");
    for (const button of this.modes) enable(button, isAlive && !isRecording, isRecording ? "A recording cannot be changed." : "No node is running.");
    this.showScenes(isAlive && !isRecording);
  }

  /** @param {boolean} canLoad */
  showScenes(canLoad) {
    const { hello, node, scene, timeline } = this.app.simulation;
    const name = node?.scene ?? scene?.name ?? timeline?.scene ?? "No scene";
    const scenes = hello?.scenes ?? [];
    const known = scenes.some((one) => one.name === name);
    const options = scenes.map((one) => {
      const isOther = node !== null && node.rate_hz > 0 && one.rate_hz !== node.rate_hz;
      // A scene of another rate begins a new run, so its label shows the rate.
      return make("option", { value: one.name, title: one.text }, isOther ? `${one.name} (${one.rate_hz} Hz)` : one.name);
    });
    if (!known) options.unshift(make("option", { value: name }, name));
    const signature = options.map((one) => one.textContent).join();
    if (this.scene.dataset.signature !== signature) {
      this.scene.replaceChildren(...options);
      this.scene.dataset.signature = signature;
    }
    this.scene.value = name;
    enable(this.scene, canLoad && scenes.length > 0, canLoad ? "" : "Loading a scene needs a running node.");
  }
}

/** @param {HTMLButtonElement} button @param {string} text */
function setText(button, text) {
  const label = button.querySelector("span");
  if (label !== null && label.textContent !== text) label.textContent = text;
}

/** @param {HTMLButtonElement | HTMLSelectElement} control @param {boolean} isEnabled @param {string} reason */
function enable(control, isEnabled, reason) {
  control.dataset.title ??= control.title;
  control.disabled = !isEnabled;
  control.title = isEnabled ? control.dataset.title : reason;
}
