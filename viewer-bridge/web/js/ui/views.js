// The view: display toggles, first view of a scene, links.

import { find } from "./dom.js";
import { firstViewBox, fittedBox, hasFreePart } from "../state/framing.js";
import { formatLink } from "../view/link.js";

/** @typedef {import("../view/link.js").CameraPose} CameraPose */
/** @typedef {import("../view/settling.js").Settling} Settling */

/** Yaw and pitch of the first view, in radians. */
const FIRST_VIEW = { yaw: 0.42, pitch: 0.16 };
/** Pitch of a scene of which something will lie on the ground. */
const PITCH_OF_FALLING = 0.42;
/** Shapes that effects draw as solid bodies. */
const SOLID_SHAPES = new Set(["rope", "ragdoll"]);
/** Limit on particles up to which scenes without a surface show them. */
const SHOW_PARTICLES_MAX = 400;

export class Views {
  /** @param {import("../tools/tool.js").App} app @param {import("./banner.js").Banner} banner @param {Settling} settling */
  constructor(app, banner, settling) {
    this.app = app;
    this.banner = banner;
    this.settling = settling;
    /** Toggles set by the user. They persist across scenes. @type {Map<string, boolean>} */
    this.chosen = new Map();
    /** The pose of a link, for the first scene only. @type {CameraPose | null} */
    this.linkedPose = null;
    /** The pose of a link to a scene that is not loaded yet. @type {{ scene: string, pose: CameraPose } | null} */
    this.poseOfScene = null;
    this.isFramed = false;
    this.isFollowing = false;
    /** The step from which a reset shows. @type {number | null} */
    this.resetStep = null;
    this.buttons = [...find("toggles", HTMLElement).querySelectorAll("button")];
    for (const button of this.buttons) button.addEventListener("click", () => this.toggle(button.dataset.toggle ?? ""));
    /** Phones have no keys. */
    this.effects = find("effects", HTMLInputElement);
    this.effects.addEventListener("change", () => this.toggle("effects"));
    app.simulation.on("scene", (scene) => this.begin(scene));
    app.simulation.on("ground", () => { if (!this.isFramed) this.showFirstView(); });
    app.simulation.on("frame", () => this.follow());
    app.simulation.on("reset", (step) => { this.resetStep = step; });
  }

  /** @param {import("../net/wire.js").Scene} scene */
  begin(scene) {
    const { camera, renderer, simulation } = this.app;
    if (this.poseOfScene?.scene === scene.name) this.linkedPose = this.poseOfScene.pose;
    this.poseOfScene = null;
    camera.axes = simulation.axes();
    camera.isFlat = scene.isPlanar;
    this.isFramed = false;
    this.isFollowing = false;
    const hasSurface = scene.triangleCount > 0;
    // Solid ropes and limbs would only wear their particles as beads.
    const isSolid = renderer.hasEffects() && scene.shapes.some((one) => SOLID_SHAPES.has(one.shape));
    const defaults = { heat: false, sticks: !hasSurface || scene.isPlanar, particles: !hasSurface && !isSolid && scene.particleCount <= SHOW_PARTICLES_MAX };
    Object.assign(renderer.toggles, defaults, Object.fromEntries(this.chosen));
    this.show();
    this.showFirstView();
  }

  /** Shows the whole scene from the default direction, or the pose of a link. */
  showFirstView() {
    const { camera, renderer, simulation } = this.app;
    const { width, height } = renderer.viewport;
    camera.yaw = FIRST_VIEW.yaw;
    camera.pitch = simulation.ground !== null && hasFreePart(simulation) ? PITCH_OF_FALLING : FIRST_VIEW.pitch;
    camera.frame(firstViewBox(simulation), width / height);
    // A scene without pins and without ground falls out of view, so the camera follows it.
    this.isFollowing = !camera.isFlat && simulation.frame !== null && simulation.ground === null && simulation.pins.size === 0;
    this.settling.begin(!this.isFollowing);
    if (this.linkedPose !== null && simulation.frame !== null) {
      Object.assign(camera, this.linkedPose);
      this.linkedPose = null;
      this.isFramed = true;
    }
    renderer.isDirty = true;
  }

  /** Fills the picture with the scene as it is now, from the current direction. */
  fit() {
    this.frame(fittedBox(this.app.simulation), false);
  }

  /** @param {import("../geometry/math.js").Box} box @param {boolean} isWatched the view follows what the scene becomes */
  frame(box, isWatched) {
    const { camera, renderer } = this.app;
    const { width, height } = renderer.viewport;
    camera.frame(box, width / height);
    this.settling.begin(isWatched);
    this.isFramed = true;
    renderer.isDirty = true;
  }

  follow() {
    const { camera, simulation } = this.app;
    if (simulation.frame !== null && !this.isFramed) {
      this.showFirstView();
      this.isFramed = true;
    }
    if (this.resetStep !== null && simulation.frame !== null && (simulation.isReplay || simulation.frame.step >= this.resetStep)) {
      this.resetStep = null;
      // A user who has not changed the view sees a reset scene whole.
      if (this.isFollowing || this.settling.isOwn()) this.frame(firstViewBox(simulation), !this.isFollowing);
    }
    this.settling.follow();
    if (!this.isFollowing || this.app.selection.isFollowed) return;
    const { min, max } = simulation.box();
    camera.target = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, (min[2] + max[2]) / 2];
  }

  /** @param {string} name */
  toggle(name) {
    const { toggles } = this.app.renderer;
    const key = /** @type {keyof typeof toggles} */ (name);
    toggles[key] = !toggles[key];
    this.chosen.set(name, toggles[key]);
    this.show();
  }

  show() {
    const { renderer } = this.app;
    for (const button of this.buttons) {
      const key = /** @type {keyof typeof renderer.toggles} */ (button.dataset.toggle);
      button.setAttribute("aria-pressed", String(renderer.toggles[key]));
    }
    this.effects.checked = renderer.toggles.effects;
    renderer.isDirty = true;
  }

  /** Writes the view into the address, and copies the address to the clipboard. */
  async copyLink() {
    const { camera, simulation } = this.app;
    const { target, distance, yaw, pitch } = camera;
    const hash = formatLink({
      scene: simulation.isReplay ? null : simulation.scene?.name ?? null,
      camera: { target, distance, yaw, pitch }, colour: this.app.renderer.coloring.quantity, toggles: Object.fromEntries(this.chosen),
    });
    history.replaceState(null, "", `#${hash}`);
    try {
      await navigator.clipboard.writeText(location.href);
      this.banner.notify("Copied a link to this view.");
    } catch {
      this.banner.notify("The link to this view is in the address bar.");
    }
  }
}
