// The buttons of the bar, the scene picker, the help, and the keys that press them.

import { find, make } from "./dom.js";
import { MODES } from "./input.js";
import { listenToKeys } from "./keys.js";

/** @typedef {import("./input.js").Mode} Mode */

/** Below this width the panel covers the picture: it is away until it is asked for. */
const PANEL_BESIDE_MIN = "(min-width: 761px)";
/** CSS pixels that an arrow key turns or moves the view by, and what + zooms by. */
const KEY_PIXELS = 30;
const KEY_ZOOM = 1.2;

export class Controls {
  /**
   * @param {import("./tools.js").Bench} bench @param {import("./input.js").Input} input
   * @param {import("./views.js").Views} views @param {import("./timeline-bar.js").TimelineBar} timeline
   * @param {import("./banner.js").Banner} banner
   */
  constructor(bench, input, views, timeline, banner) {
    this.bench = bench;
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
    const { simulation } = bench;
    for (const topic of /** @type {const} */ (["hello", "node", "playback", "scene", "parameters"])) simulation.on(topic, () => this.show());
  }

  listen() {
    this.pause.addEventListener("click", () => this.togglePause());
    this.step.addEventListener("click", () => this.stepOnce(1));
    this.reset.addEventListener("click", () => this.bench.commands.run("reset"));
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
    const { views, bench } = this;
    /** @type {import("./keys.js").Keymap} */
    const keymap = {
      " ": () => this.togglePause(),
      ".": () => this.stepOnce(1),
      ",": () => { if (bench.simulation.isReplay) this.stepOnce(-1); },
      r: () => { if (!this.reset.disabled) bench.commands.run("reset"); },
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
    const { camera, renderer, simulation } = this.bench;
    if (simulation.isReplay && x !== 0) return this.stepOnce(x);
    if (camera.isFlat) camera.pan(-x * KEY_PIXELS, -y * KEY_PIXELS, renderer.viewport);
    else camera.orbit(-x * KEY_PIXELS, -y * KEY_PIXELS);
    renderer.isDirty = true;
  }

  /** @param {number} factor */
  zoom(factor) {
    const { camera, renderer } = this.bench;
    camera.zoom(factor, renderer.viewport.width / 2, renderer.viewport.height / 2, renderer.viewport);
    renderer.isDirty = true;
  }

  togglePause() {
    if (this.pause.disabled) return;
    this.bench.commands.run(this.bench.simulation.isPaused ? "resume" : "pause");
  }

  /** A step of what runs is a pause and a step. @param {number} count */
  stepOnce(count) {
    if (this.step.disabled) return;
    if (this.bench.simulation.isReplay) return this.timeline.step(count);
    if (!this.bench.simulation.isPaused) this.bench.commands.run("pause");
    this.bench.commands.run("step", { count });
  }

  /** @param {string} scene */
  load(scene) {
    this.bench.commands.run("load", { scene }, (outcome) => {
      if (outcome.status !== "applied") this.show();
    });
  }

  /** @param {number} index */
  loadNumber(index) {
    const option = this.scene.options[index];
    if (option !== undefined && !option.disabled && !this.scene.disabled) this.load(option.value);
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
    const { simulation } = this.bench;
    return !simulation.isReplay && !(simulation.node?.is_replay ?? false) && simulation.node?.state === "alive";
  }

  /** Brings the controls to what is true now, and says of disabled ones why. */
  show() {
    const { simulation } = this.bench;
    const isAlive = simulation.node?.state === "alive" || simulation.isReplay;
    const isRecording = simulation.isReplay || (simulation.node?.is_replay ?? false);
    this.pause.setAttribute("aria-pressed", String(simulation.isPaused));
    setText(this.pause, simulation.isPaused ? "Go on" : "Pause");
    enable(this.pause, isAlive, "No node is running.");
    enable(this.step, isAlive, "No node is running.");
    enable(this.reset, isAlive && !isRecording, isRecording ? "A recording cannot be reset: drag its bar." : "No node is running.");
    for (const button of this.modes) enable(button, isAlive && !isRecording, isRecording ? "A recording cannot be changed." : "No node is running.");
    this.showScenes(isAlive && !isRecording);
  }

  /** @param {boolean} canLoad */
  showScenes(canLoad) {
    const { hello, node, scene, timeline } = this.bench.simulation;
    const name = node?.scene ?? scene?.name ?? timeline?.scene ?? "No scene";
    const scenes = hello?.scenes ?? [];
    const known = scenes.some((one) => one.name === name);
    const options = scenes.map((one) => {
      const isOther = node !== null && node.rate_hz > 0 && one.rate_hz !== node.rate_hz;
      // Whether a node takes another rate, only its answer tells: the label warns, the outcome decides.
      return make("option", { value: one.name, title: one.text }, isOther ? `${one.name} (${one.rate_hz} Hz)` : one.name);
    });
    if (!known) options.unshift(make("option", { value: name }, name));
    const signature = options.map((one) => one.textContent).join();
    if (this.scene.dataset.signature !== signature) {
      this.scene.replaceChildren(...options);
      this.scene.dataset.signature = signature;
    }
    this.scene.value = name;
    enable(this.scene, canLoad && scenes.length > 0, canLoad ? "" : "A scene is loaded by a running node.");
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
