// What is shown and how: the toggles, the strain scale, the first look at a scene, pictures, links.

import { find, sharpContext } from "./dom.js";
import { stageOf } from "./framing.js";
import { formatLink } from "./link.js";
import { niceCeiling, readable } from "./plot.js";
import { HEAT_STOPS } from "./theme.js";

/** @typedef {import("./link.js").CameraPose} CameraPose */

/** The end of an automatic strain scale is never below this: rounding is no load. */
const HEAT_LEAST = 0.002;
/** An automatic scale ends at so many times the mean strain, or at the greatest. */
const HEAT_MEANS = 8;
/** Yaw and pitch of the first look. */
const FIRST_LOOK = { yaw: 0.42, pitch: 0.16 };
/** Scenes up to so many particles without a surface show them. */
const SHOW_PARTICLES_MAX = 400;

export class Views {
  /** @param {import("./tools.js").Bench} bench @param {import("./banner.js").Banner} banner */
  constructor(bench, banner) {
    this.bench = bench;
    this.banner = banner;
    this.range = find("heat-range", HTMLSelectElement);
    this.legend = find("legend", HTMLElement);
    /** Toggles that the user has set: they stay from scene to scene. @type {Map<string, boolean>} */
    this.chosen = new Map();
    /** A pose out of a link, for the first scene only. @type {CameraPose | null} */
    this.linkedPose = null;
    this.isFramed = false;
    this.isFollowing = false;
    this.buttons = [...find("toggles", HTMLElement).querySelectorAll("button")];
    for (const button of this.buttons) button.addEventListener("click", () => this.toggle(button.dataset.toggle ?? ""));
    this.range.addEventListener("change", () => this.scaleHeat());
    bench.simulation.on("scene", (scene) => this.begin(scene));
    bench.simulation.on("ground", () => { if (!this.isFramed) this.look(); });
    bench.simulation.on("frame", () => this.follow());
    bench.simulation.on("stats", () => this.scaleHeat());
    bench.simulation.on("reset", () => { if (this.isFollowing) this.look(); });
  }

  /** @param {import("./wire.js").Scene} scene */
  begin(scene) {
    const { camera, renderer, simulation } = this.bench;
    camera.axes = simulation.axes();
    camera.isFlat = scene.isPlanar;
    this.isFramed = false;
    this.isFollowing = false;
    const hasSurface = scene.triangleCount > 0;
    const defaults = { heat: false, sticks: !hasSurface || scene.isPlanar, particles: !hasSurface && scene.particleCount <= SHOW_PARTICLES_MAX };
    Object.assign(renderer.toggles, defaults, Object.fromEntries(this.chosen));
    this.show();
    this.look();
  }

  /** The first look at a scene, or all of it again. */
  look() {
    const { camera, renderer, simulation } = this.bench;
    const { width, height } = renderer.viewport;
    camera.yaw = FIRST_LOOK.yaw;
    camera.pitch = FIRST_LOOK.pitch;
    camera.frame(stageOf(simulation), width / height);
    if (this.linkedPose !== null && simulation.frame !== null) {
      Object.assign(camera, this.linkedPose);
      this.linkedPose = null;
      this.isFramed = true;
    }
    // What nothing holds and nothing catches falls out of every picture: the camera goes with it.
    this.isFollowing = !camera.isFlat && simulation.frame !== null && simulation.ground === null && simulation.pins.size === 0;
    renderer.isDirty = true;
  }

  /** All of what is there now, from where the camera looks. */
  frame() {
    const { camera, renderer, simulation } = this.bench;
    const { width, height } = renderer.viewport;
    camera.frame(stageOf(simulation), width / height);
    this.isFramed = true;
    renderer.isDirty = true;
  }

  follow() {
    const { camera, simulation } = this.bench;
    if (simulation.frame !== null && !this.isFramed) {
      this.look();
      this.isFramed = true;
    }
    if (!this.isFollowing) return;
    const { min, max } = simulation.box();
    camera.target = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2];
  }

  /** @param {string} name */
  toggle(name) {
    const { toggles } = this.bench.renderer;
    const key = /** @type {keyof typeof toggles} */ (name);
    toggles[key] = !toggles[key];
    this.chosen.set(name, toggles[key]);
    this.show();
  }

  show() {
    const { renderer } = this.bench;
    for (const button of this.buttons) {
      const key = /** @type {keyof typeof renderer.toggles} */ (button.dataset.toggle);
      button.setAttribute("aria-pressed", String(renderer.toggles[key]));
    }
    this.legend.hidden = !renderer.toggles.heat;
    this.scaleHeat();
    renderer.isDirty = true;
  }

  /** The scale's end: what was chosen, or a round number above what is measured, that does not flutter. */
  scaleHeat() {
    const { renderer, simulation } = this.bench;
    if (!renderer.toggles.heat) return;
    const { stretchMax, stretchMean } = simulation.stats ?? { stretchMax: 0, stretchMean: 0 };
    // A single edge at a pin is stretched far more than the rest: it may be beyond the scale.
    const measured = Math.max(Math.min(stretchMax, stretchMean * HEAT_MEANS) || 0, HEAT_LEAST);
    const isFixed = this.range.value !== "auto";
    if (isFixed) renderer.heatMax = Number(this.range.value);
    else if (measured > renderer.heatMax || measured < renderer.heatMax * 0.3) renderer.heatMax = niceCeiling(measured);
    find("heat-end", HTMLOutputElement).textContent = `≥ ${readable(renderer.heatMax, "%")}`;
    drawRamp(find("ramp", HTMLCanvasElement));
    renderer.isDirty = true;
  }

  savePicture() {
    const { renderer, simulation } = this.bench;
    renderer.draw();
    renderer.canvas.toBlob((blob) => {
      if (blob === null) return this.banner.notify("The picture could not be saved.", "error");
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${simulation.scene?.name || "catenary"}-${simulation.frame?.step ?? 0}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    }, "image/png");
  }

  /** Puts the view into the address, and the address onto the clipboard. */
  async copyLink() {
    const { camera, simulation } = this.bench;
    const { target, distance, yaw, pitch } = camera;
    const hash = formatLink({
      scene: simulation.isReplay ? null : simulation.scene?.name ?? null,
      camera: { target, distance, yaw, pitch }, toggles: Object.fromEntries(this.chosen),
    });
    history.replaceState(null, "", `#${hash}`);
    try {
      await navigator.clipboard.writeText(location.href);
      this.banner.notify("The link to this view is copied.");
    } catch {
      this.banner.notify("The link to this view is in the address bar.");
    }
  }
}

/** @param {HTMLCanvasElement} canvas */
function drawRamp(canvas) {
  const { context, width, height } = sharpContext(canvas);
  const ramp = context.createLinearGradient(0, 0, width, 0);
  HEAT_STOPS.forEach((color, stop) => ramp.addColorStop(stop / (HEAT_STOPS.length - 1), color));
  context.fillStyle = ramp;
  context.fillRect(0, 0, width, height);
}
