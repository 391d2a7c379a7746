// Draws the picture, layer by layer. Uploads only what has changed since the last picture, and draws
// only if something has.

import { dot, multiply, shadowOnto } from "../geometry/math.js";
import { POINTS, STICKS, stylesOf } from "./styles.js";
import { paletteOf } from "./theme.js";
import { PAINT } from "./shaders.js";
import { isSoftware, openContext, rendererName } from "./context.js";
import { Arrows } from "./arrows.js";
import { Drawables, SceneBuffers } from "./buffers.js";
import { Colliders, placeCapsule, placeCollider } from "./colliders.js";
import { Ground } from "./ground.js";
import { PictureUniforms } from "./picture-uniforms.js";
import { MAP_SIZE, ShadowMap } from "./shadow-map.js";
import { Sticks } from "./particles/sticks.js";
import { ForceScale, arrowsOf } from "../state/forces.js";
import { polesOf } from "../state/shapes.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../state/simulation.js").Simulation} Simulation */
/** @typedef {import("../geometry/camera.js").Camera} Camera */
/** @typedef {{ surface: boolean, sticks: boolean, particles: boolean, pins: boolean, heat: boolean, shadow: boolean, forces: boolean, effects: boolean }} Toggles */

/** Limit on device pixels per CSS pixel: the cost grows with the square, and a finer picture looks the same. */
const PIXEL_RATIO_MAX = 2;
/** Width of the shaft of a force arrow, in CSS pixels. */
const ARROW_WIDTH = 3;
/** Depth that solids are drawn behind their place: about 0.15 % of the distance. */
const COLLIDER_BEHIND = { slopes: 1, units: 500 };

export class Renderer {
  /** @param {HTMLCanvasElement} canvas @param {Simulation} simulation @param {Camera} camera @param {boolean} antialias */
  constructor(canvas, simulation, camera, antialias) {
    this.canvas = canvas;
    /** @type {Colliders | undefined} */
    this.colliders = undefined;
    this.simulation = simulation;
    this.camera = camera;
    const gl = openContext(canvas, antialias);
    if (gl === null) throw new Error("no WebGL2");
    this.gl = gl;
    this.isDark = false;
    /** CSS pixels of the canvas. */
    this.viewport = { width: 1, height: 1 };
    /** The quantity that the colours show, and its values at both ends of the ramp. @type {{ quantity: import("../state/quantity.js").Quantity, low: number, high: number }} */
    this.coloring = { quantity: "strain", low: -0.05, high: 0.05 };
    /** @type {Toggles} */
    this.toggles = { surface: true, sticks: false, particles: false, pins: true, heat: false, shadow: true, forces: false, effects: !isSoftware(rendererName(gl)) };
    this.forceScale = new ForceScale();
    /** The drawn forces. @type {import("../state/forces.js").Arrow[]} */
    this.arrowsDrawn = [];
    this.framesDrawn = 0;
    this.stepDrawn = -1;
    /** @type {import("../net/wire.js").Frame | null} */
    this.frameDrawn = null;
    /** @type {import("../net/wire.js").Ghost | null} */
    this.ghostWritten = null;
    this.isDirty = true;
    this.uniforms = new PictureUniforms(this);
    /** Parts that have changed since they were uploaded. */
    this.stale = { topology: false, particles: false, marks: false, colliders: true, poles: true };
    this.measure();
    this.create();
    this.listen();
  }

  get rendererName() {
    return rendererName(this.gl);
  }

  /** Creates every object of the context: at first, and again after the context was lost. */
  create() {
    /** By whether there are effects. @type {Map<boolean, { ground: Ground, colliders: Colliders }>} */
    this.surroundings = new Map();
    this.chooseSurroundings(false);
    this.arrows = new Arrows(this.gl);
    this.uniforms.create();
    /** Created for the first picture with effects. @type {ShadowMap | null} */
    this.shadowMap = null;
    /** By variant. All are kept, because compiling is slow. @type {Map<string, Drawables>} */
    this.drawablesByVariant = new Map();
    /** Created for the first ghost. @type {Sticks | null} */
    this.ghostSticks = null;
    /** Those for the format of the frame. @type {Drawables | null} */
    this.drawables = null;
    /** @type {SceneBuffers | null} */
    this.buffers = null;
    this.frameDrawn = null;
    this.isDirty = true;
  }

  /** Soft shadows, weave and solid bodies are drawn: in 3-D, unless they are turned off. */
  hasEffects() {
    return this.toggles.effects && this.simulation.scene !== null && !this.simulation.scene.isPlanar;
  }

  /** Makes the ground and the colliders those with or without effects. @param {boolean} hasEffects */
  chooseSurroundings(hasEffects) {
    const chosen = this.surroundings?.get(hasEffects) ?? { ground: new Ground(this.gl, hasEffects), colliders: new Colliders(this.gl, hasEffects) };
    this.surroundings?.set(hasEffects, chosen);
    /** @type {Ground | undefined} */
    this.ground = chosen.ground;
    if (this.colliders !== chosen.colliders) this.stale.colliders = this.stale.poles = true;
    this.colliders = chosen.colliders;
  }

  listen() {
    const { simulation } = this;
    simulation.on("scene", () => {
      this.forceScale = new ForceScale();
      this.invalidate({});
    });
    simulation.on("frame", () => this.invalidate({}));
    simulation.on("tear", () => this.invalidate({ topology: true, particles: true }));
    simulation.on("pins", () => this.invalidate({ marks: true, poles: true }));
    simulation.on("colliders", () => this.invalidate({ colliders: true }));
    simulation.on("ground", () => this.invalidate({ poles: true }));
  }

  /** @param {Partial<Renderer["stale"]>} what */
  invalidate(what) {
    Object.assign(this.stale, what);
    this.isDirty = true;
  }

  /** Reads the size of the canvas. Call it only when the size has changed, because reading can force a layout. */
  measure() {
    const { clientWidth, clientHeight } = this.canvas;
    this.viewport = { width: Math.max(1, clientWidth), height: Math.max(1, clientHeight) };
    this.isDirty = true;
  }

  /** Resizes the drawing buffer to the canvas element. */
  resize() {
    const ratio = Math.min(globalThis.devicePixelRatio || 1, PIXEL_RATIO_MAX);
    const width = Math.round(this.viewport.width * ratio);
    const height = Math.round(this.viewport.height * ratio);
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.isDirty = true;
  }

  /** Draws the newest frame. readPixels sees it only in the same task. */
  draw() {
    const { gl } = this;
    if (gl.isContextLost()) return;
    this.resize();
    this.uploadOrSimplify();
    // Each picture binds what it reads: the one before may have been of another scene.
    this.buffers?.bind();
    this.uniforms.update();
    // Its texture is bound even if nothing casts a shadow.
    if (this.hasEffects()) this.shadowMap ??= new ShadowMap(gl);
    if (this.uniforms.lightView !== null) this.drawShadowMap(this.uniforms.lightView);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.drawSurroundings();
    if (this.simulation.scene?.isPlanar) this.drawFlat();
    else this.drawSolid();
    this.drawGhost();
    this.drawForces();
    this.framesDrawn++;
    this.isDirty = false;
  }

  /** Uploads whatever has changed. A device that cannot compile the effects draws without them. */
  uploadOrSimplify() {
    try {
      this.upload();
    } catch (error) {
      if (!this.hasEffects()) throw error;
      this.toggles.effects = false;
      this.upload();
    }
  }

  /** Uploads whatever has changed. */
  upload() {
    const { simulation, stale } = this;
    const { frame, scene } = simulation;
    if (frame === null || scene === null) {
      this.buffers?.delete();
      this.buffers = null;
      return;
    }
    this.chooseSurroundings(this.hasEffects());
    const drawables = this.drawablesFor({ isQuantised: frame.isQuantised, hasEffects: this.hasEffects() });
    this.drawables = drawables;
    if (this.buffers === null || this.buffers.scene !== scene || this.buffers.drawables !== drawables) {
      this.buffers?.delete();
      this.buffers = new SceneBuffers(this.gl, simulation, drawables);
      this.frameDrawn = this.ghostWritten = null;
      stale.topology = stale.particles = stale.marks = false;
      stale.colliders = stale.poles = true;
    }
    if (stale.topology) this.buffers.writeTopology();
    if (stale.particles) this.buffers.writeParticles();
    if (stale.marks) this.buffers.writeMarks();
    if (frame !== this.frameDrawn) this.buffers.writePositions(frame);
    if (simulation.speeds !== null && this.paint() === PAINT.speeds) this.buffers.writeSpeeds(simulation.speeds.speeds);
    if (simulation.ghost !== null && simulation.ghost !== this.ghostWritten) this.buffers.writeGhost(simulation.ghost, () => this.sticksOfGhosts());
    this.ghostWritten = simulation.ghost;
    if (stale.colliders) this.placeColliders(scene.isPlanar);
    if (stale.poles) this.placePoles();
    this.frameDrawn = frame;
    this.stepDrawn = frame.step;
    this.stale = { topology: false, particles: false, marks: false, colliders: false, poles: false };
  }

  /** The quantity that the shaders colour by. Speeds that have not arrived yet are not drawn. */
  paint() {
    if (!this.toggles.heat) return PAINT.off;
    const { quantity } = this.coloring;
    if (quantity === "speed") return this.simulation.speeds === null ? PAINT.off : PAINT.speeds;
    return quantity === "kind" ? PAINT.kinds : PAINT.constraints;
  }

  /** @param {import("./context.js").Variant} variant */
  drawablesFor(variant) {
    const key = JSON.stringify(variant);
    const drawables = this.drawablesByVariant.get(key) ?? new Drawables(this.gl, variant);
    this.drawablesByVariant.set(key, drawables);
    return drawables;
  }

  sticksOfGhosts() {
    this.ghostSticks ??= new Sticks(this.gl, { isQuantised: false, hasEffects: false });
    return this.ghostSticks;
  }

  /** @param {boolean} isPlanar */
  placeColliders(isPlanar) {
    const { simulation, colliders } = this;
    if (!colliders) return;
    colliders.loadMeshes(simulation.scene?.meshes ?? new Map());
    colliders.placed = simulation.colliders.flatMap((one) => placeCollider(one, isPlanar, this.camera.target, simulation.radius()));
  }

  placePoles() {
    if (!this.colliders) return;
    this.colliders.poles = this.hasEffects() ? polesOf(this.simulation).map(({ top, foot, radius }) => placeCapsule(foot, top, radius)) : [];
  }

  drawSurroundings() {
    const { gl, ground, simulation } = this;
    gl.disable(gl.DEPTH_TEST);
    gl.depthMask(false);
    ground?.drawBackdrop(this.styles.backdrop);
    if (simulation.ground !== null && !simulation.scene?.isPlanar) {
      this.drawPlane(simulation.ground);
      // Soft shadows belong to the effects. A plain one is cheap, and shows how high things are.
      if (this.toggles.shadow && !this.hasEffects()) this.drawShadows(simulation.ground);
    }
    gl.depthMask(true);
  }

  /** @param {import("../state/simulation.js").Plane} plane */
  drawPlane(plane) {
    const { camera, simulation } = this;
    this.ground?.drawPlane(plane, camera, simulation.radius(), paletteOf(this.isDark));
  }

  /** Draws what casts shadows, as the light sees it. @param {import("./shadow-map.js").LightView} light */
  drawShadowMap(light) {
    this.gl.disable(this.gl.BLEND);
    this.uniforms.beginPass({ u_shadow: 1, u_view_projection: light.clip, u_viewport: [MAP_SIZE, MAP_SIZE], u_pixels_per_unit: 1 / light.texel, u_near: 0 });
    this.shadowMap?.draw(() => {
      this.colliders?.draw(this.styles.colliders.shadow);
      if (this.toggles.surface) this.drawables?.cloth.drawShadow();
      this.drawables?.planks?.draw();
      this.drawSticks(STICKS.mapped);
    });
    this.uniforms.endPass();
  }

  /** Draws shadows onto the ground. The stencil buffer makes sure that each pixel is darkened only once.
   * @param {import("../state/simulation.js").Plane} plane */
  drawShadows(plane) {
    const { gl, uniforms } = this;
    if (dot(plane.normal, this.camera.eye()) < plane.offset) return;
    const flattened = shadowOnto(plane.normal, plane.offset, uniforms.light());
    uniforms.beginPass({
      u_shadow: paletteOf(this.isDark).shadow, u_view_projection: multiply(uniforms.viewProjection, flattened),
      // The flattening matrix scales w by its last element, and sizes in pixels are divided by w.
      u_pixels_per_unit: uniforms.shared.members.u_pixels_per_unit[0] * flattened[15],
    });
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    this.colliders?.draw(this.styles.colliders.shadow);
    if (this.toggles.surface) this.drawables?.cloth.drawShadow();
    this.drawSticks(STICKS.shadow);
    gl.disable(gl.STENCIL_TEST);
    uniforms.endPass();
  }

  drawSolid() {
    const { gl, simulation, drawables } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    // The triangles between particles that rest on a round solid cut into it a little.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(COLLIDER_BEHIND.slopes, COLLIDER_BEHIND.units);
    this.colliders?.draw(this.styles.colliders.solid);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    const { ground } = simulation;
    for (const one of simulation.colliders) {
      if (one.shape !== "plane" || (ground !== null && one.offset === ground.offset && dot(one.normal, ground.normal) > 0.999)) continue;
      gl.depthMask(false);
      this.drawPlane(one);
      gl.depthMask(true);
    }
    if (this.buffers === null || drawables === null) return;
    if (this.toggles.surface) drawables.cloth.draw(this.styles.cloth.solid);
    drawables.planks?.draw();
    this.drawSticks(STICKS.solid);
    this.drawPoints(POINTS.solid);
  }

  /** Draws a 2-D scene without a depth test: later layers cover earlier ones. */
  drawFlat() {
    const { gl, drawables } = this;
    gl.disable(gl.DEPTH_TEST);
    this.colliders?.draw(this.styles.colliders.flat);
    if (this.buffers === null || drawables === null) return;
    if (this.toggles.surface) drawables.cloth.draw(this.styles.cloth.flat);
    this.drawSticks(STICKS.flat);
    this.drawPoints(POINTS.flat);
  }

  /** @param {import("./context.js").Uniforms} style */
  drawSticks(style) {
    this.drawables?.sticks.draw(this.uniforms.sceneStyles.sticks, style);
  }

  drawGhost() {
    const { buffers, simulation, uniforms } = this;
    if (simulation.ghost === null || !buffers?.ghost) return;
    uniforms.beginPass(this.styles.ghost);
    buffers.ghost.draw(uniforms.sceneStyles.sticks, buffers.positions, { isFlat: simulation.scene?.isPlanar ?? false });
    uniforms.endPass();
  }

  /** @param {Record<"particles" | "marks", import("./context.js").Uniforms>} styles */
  drawPoints(styles) {
    const { drawables, toggles } = this;
    if (drawables === null) return;
    const { points } = drawables;
    const { sceneStyles } = this.uniforms;
    if (toggles.particles) points.draw(points.particles, sceneStyles.particles, styles.particles);
    if (!toggles.pins) return;
    points.draw(points.marks, sceneStyles.marks, styles.marks);
    // A grabbed particle stays visible behind a fold.
    this.gl.disable(this.gl.DEPTH_TEST);
    points.draw(points.grabbed, sceneStyles.grabbed, styles.marks);
  }

  drawForces() {
    this.arrowsDrawn = this.toggles.forces && this.buffers !== null ? arrowsOf(this.simulation) : [];
    this.forceScale.follow(this.arrowsDrawn);
    const palette = paletteOf(this.isDark);
    const ratio = this.canvas.height / this.viewport.height;
    this.arrows?.set(this.arrowsDrawn, this.unitsPerNewton());
    this.arrows?.draw({ width: ARROW_WIDTH * ratio, rim: ratio, color: palette.force, rimColor: palette.ring });
  }

  /** Length of a force arrow per newton. */
  unitsPerNewton() {
    return this.forceScale.unitsPerNewton(this.simulation.radius());
  }

  get styles() {
    return stylesOf(this.isDark);
  }

  hasSurface() {
    return (this.simulation.scene?.triangleCount ?? 0) > 0;
  }
}
