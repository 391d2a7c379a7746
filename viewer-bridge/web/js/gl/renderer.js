// Draws the picture, layer by layer. Uploads only what has changed since the last picture, and draws
// only if something has.

import { add, addScaled, dot, multiply, normalize, scale, scaleThenMove, shadowOnto, tangents } from "../geometry/math.js";
import { paletteOf, paletteUniforms } from "./theme.js";
import { PAINT } from "./shaders.js";
import { isSoftware, openContext, rendererName, setNumber } from "./context.js";
import { Arrows } from "./arrows.js";
import { Drawables, SceneBuffers } from "./buffers.js";
import { Colliders, placeCapsule, placeCollider } from "./colliders.js";
import { Ground } from "./ground.js";
import { MAP_SIZE, ShadowMap, clipBox, lightView } from "./shadow-map.js";
import { Sticks } from "./particles/sticks.js";
import { ForceScale, arrowsOf } from "../state/forces.js";
import { includeSolids } from "../state/framing.js";
import { polesOf } from "../state/shapes.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../state/simulation.js").Simulation} Simulation */
/** @typedef {import("../geometry/camera.js").Camera} Camera */
/** @typedef {import("./context.js").Uniforms} Uniforms */
/** @typedef {{ surface: boolean, sticks: boolean, particles: boolean, pins: boolean, heat: boolean, shadow: boolean, forces: boolean, effects: boolean }} Toggles */

/** Limit on device pixels per CSS pixel: the cost grows with the square, and a finer picture looks the same. */
const PIXEL_RATIO_MAX = 2;
/** Distance of the lamp, in radii of the scene. */
const LAMP_RADII = 2.6;
/** Size of the ground, in radii of the scene; it fades out towards its edge. */
const GROUND_RADII = 6;
/** Width of the shaft of a force arrow, in CSS pixels. */
const ARROW_WIDTH = 3;
/** Width of a thread of the weave, in distances between particles. */
const THREAD_SPACINGS = 0.25;
/** Reach of shadows around the target of the camera, in distances from it: a little more than the picture shows. */
const SHADOW_REACH = 1.2;
/** Depth that solids are drawn behind their place: about 0.15 % of the distance. */
const COLLIDER_BEHIND = { slopes: 1, units: 500 };
/** Scenes with more particles than a ragdoll are drawn with thinner sticks. */
const FEW_PARTICLES = 60;

/** Depth by which sticks and points come forward, and their roundness. A new object in each picture would be garbage. */
const STICKS = { solid: { u_forward: 4e-4 }, flat: { u_round: 0.35 }, shadow: {} };
const POINTS = { solid: { forward: 1.2e-3, round: 1 }, flat: { forward: 0, round: 0.6 } };
const [ORIGIN, ONES, NO_COLOR] = [[0, 0, 0], [1, 1, 1], [0, 0, 0, 0]];

/** A matrix that takes every point out of the shadow map, where everything is lit. */
const NOWHERE = scaleThenMove([-9, -9, 0], [0, 0, 0]);

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
    /** By whether the theme is dark: the uniforms of all programs, which each picture writes in place. @type {Map<boolean, Uniforms>} */
    this.uniformsByTheme = new Map();
    /** Those of points. @type {Uniforms} */
    this.pointUniforms = { u_forward: 0, u_round: 1, u_radius: 0, u_radius_min: 0 };
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
    /** Created for the first picture with effects. @type {ShadowMap | null} */
    this.shadowMap = null;
    /** Where the light looks at in the present picture; null without effects, or without anything near. @type {import("./shadow-map.js").LightView | null} */
    this.lightView = null;
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

  /** Shadows, weave and solid bodies are drawn: in 3-D, unless they are turned off. */
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
    const uniforms = this.uniforms();
    // Its texture is bound even if nothing casts a shadow.
    if (this.hasEffects()) this.shadowMap ??= new ShadowMap(gl);
    if (this.lightView !== null) this.drawShadowMap(uniforms, this.lightView);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.drawSurroundings(uniforms);
    if (this.simulation.scene?.isPlanar) this.drawFlat(uniforms);
    else this.drawSolid(uniforms);
    this.drawGhost(uniforms);
    this.drawForces(uniforms);
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

  /** The view of the light, onto what is near the picture; null without effects. @param {Vec3} light */
  viewOfLight(light) {
    const { simulation, camera, toggles } = this;
    if (!this.hasEffects() || !toggles.shadow || simulation.frame === null) return null;
    const { min, max } = simulation.frame.bounds;
    const box = { min: /** @type {Vec3} */ ([...min]), max: /** @type {Vec3} */ ([...max]) };
    includeSolids(box, simulation);
    const near = clipBox(box, camera.target, camera.distance * SHADOW_REACH);
    return near === null ? null : lightView(light, near);
  }

  /** The uniforms of all programs. @returns {Uniforms} */
  uniforms() {
    const { camera, simulation, canvas, viewport } = this;
    const palette = paletteOf(this.isDark);
    const { up, right, toward } = camera.axes;
    const light = normalize(add(add(scale(up, 0.8), scale(toward, 0.62)), scale(right, -0.5)));
    const projection = camera.projection(viewport.width / viewport.height);
    const isFlat = camera.isFlat;
    const hasSurface = this.hasSurface();
    const ground = simulation.ground;
    const basis = camera.basis();
    this.lightView = this.viewOfLight(light);
    const all = this.uniformsByTheme.get(this.isDark) ?? { ...paletteUniforms(this.isDark) };
    this.uniformsByTheme.set(this.isDark, all);
    all.u_view_projection = multiply(projection, camera.view());
    all.u_lo = simulation.frame?.lo ?? ORIGIN;
    all.u_scale = simulation.frame?.scale ?? ONES;
    all.u_viewport = [canvas.width, canvas.height];
    all.u_eye = camera.eye();
    all.u_up = up;
    all.u_light = light;
    // Close enough that a flat cloth is not uniformly lit. The shadow treats the light as distant.
    all.u_lamp = addScaled(simulation.middle(), light, simulation.radius() * LAMP_RADII);
    setNumber(all, "u_pixels_per_unit", (projection[5] * canvas.height) / 2);
    setNumber(all, "u_near", isFlat ? 0 : camera.distance * 0.02);
    all.u_paint = this.paint();
    setNumber(all, "u_heat_low", this.coloring.low);
    setNumber(all, "u_heat_high", this.coloring.high);
    all.u_flat = isFlat ? [...palette.flatSurface, 0.85] : NO_COLOR;
    all.u_stick = isFlat && hasSurface ? palette.flatStick : palette.stick;
    // A dark ball is invisible on the dark end of the heat map.
    all.u_particle = this.toggles.heat && this.toggles.surface && hasSurface ? palette.ring : palette.particle;
    all.u_particle_count = simulation.scene?.particleCount ?? 0;
    all.u_round = 1;
    setNumber(all, "u_opacity", hasSurface && !isFlat ? 0.75 : 1);
    all.u_forward = all.u_shadow = 0;
    all.u_is_all = this.areAllSticksDrawn() ? 1 : 0;
    all.u_ground = ground ? [...ground.normal, ground.offset] : [...up, -1e9];
    all.u_right = basis.right;
    all.u_upward = basis.up;
    all.u_is_solid = this.hasEffects() ? 1 : 0;
    setNumber(all, "u_thread", (this.buffers?.spacing ?? 1) * THREAD_SPACINGS);
    all.u_to_shadow_map = this.lightView?.map ?? NOWHERE;
    setNumber(all, "u_texel", this.lightView?.texel ?? 0);
    this.setSizes(all, hasSurface, isFlat);
    return all;
  }

  /** Radii of sticks and points: a fraction of the spacing between particles, but always visible.
   * @param {Uniforms} all @param {boolean} hasSurface @param {boolean} isFlat */
  setSizes(all, hasSurface, isFlat) {
    const { simulation, canvas, viewport } = this;
    const ratio = canvas.height / viewport.height;
    const spacing = this.buffers?.spacing ?? simulation.radius() * 0.5;
    const count = simulation.scene?.particleCount ?? 0;
    const thick = Math.min(spacing * 0.13, simulation.radius() * (count > FEW_PARTICLES ? 0.006 : 0.02));
    setNumber(all, "u_radius", hasSurface && !isFlat ? 0 : hasSurface ? thick * 0.5 : thick);
    setNumber(all, "u_radius_min", (hasSurface ? 0.6 : 1.1) * ratio);
    setNumber(all, "u_point_radius", hasSurface ? 0 : thick * 1.5);
    setNumber(all, "u_point_min", (hasSurface ? 1.8 : count < 20 ? 6 : 2.4) * ratio);
    setNumber(all, "u_mark_min", (count > 2000 ? 4 : 5.5) * ratio);
  }

  /** @param {Uniforms} uniforms */
  drawSurroundings(uniforms) {
    const { gl, ground, simulation } = this;
    const palette = paletteOf(this.isDark);
    gl.disable(gl.DEPTH_TEST);
    gl.depthMask(false);
    ground?.drawBackdrop({ u_top: palette.backdropTop, u_bottom: palette.backdropBottom });
    if (simulation.ground !== null && !simulation.scene?.isPlanar) {
      this.drawPlane(simulation.ground, uniforms, this.camera.target);
      if (this.toggles.shadow && !this.hasEffects()) this.drawShadows(simulation.ground, uniforms);
    }
    gl.depthMask(true);
  }

  /** Draws a plane as a patch of ground that fades out, with grid lines at round coordinates.
   * @param {import("../state/simulation.js").Plane} plane @param {Uniforms} uniforms @param {Vec3} near */
  drawPlane(plane, uniforms, near) {
    const palette = paletteOf(this.isDark);
    const size = Math.max(this.simulation.radius(), this.camera.distance * 0.4) * GROUND_RADII;
    const middle = addScaled(near, plane.normal, plane.offset - dot(plane.normal, near));
    const [along, across] = tangents(plane.normal);
    const spacing = 10 ** Math.floor(Math.log10(this.camera.distance * 0.16));
    const period = spacing * 10;
    const shift = [along, across].map((axis) => ((dot(axis, middle) % period) + period) % period);
    this.ground?.draw({
      u_view_projection: uniforms.u_view_projection, u_middle: middle, u_along: along, u_across: across,
      u_size: size, u_shift: shift, u_fill: palette.ground, u_line: palette.gridLine, u_contrast: palette.gridContrast, u_spacing: spacing,
      u_normal: plane.normal, u_shadow: palette.shadow, u_to_shadow_map: uniforms.u_to_shadow_map, u_texel: uniforms.u_texel,
    });
  }

  /** Draws what casts shadows, as the light sees it. @param {Uniforms} uniforms @param {import("./shadow-map.js").LightView} light */
  drawShadowMap(uniforms, light) {
    this.gl.disable(this.gl.BLEND);
    const casting = {
      ...uniforms, u_shadow: 1, u_view_projection: light.clip, u_viewport: [MAP_SIZE, MAP_SIZE],
      u_pixels_per_unit: 1 / light.texel, u_near: 0, u_radius_min: 0.7,
    };
    this.shadowMap?.draw(() => {
      this.colliders?.draw(casting);
      if (this.toggles.surface) this.drawables?.cloth.drawShadow(casting);
      this.drawables?.planks?.draw(casting);
      this.drawSticks(casting);
    });
  }

  /** Draws shadows onto the ground. The stencil buffer makes sure that each pixel is darkened only once.
   * @param {import("../state/simulation.js").Plane} plane @param {Uniforms} uniforms */
  drawShadows(plane, uniforms) {
    const { gl } = this;
    const eye = /** @type {Vec3} */ (uniforms.u_eye);
    if (dot(plane.normal, eye) < plane.offset) return;
    const flattened = shadowOnto(plane.normal, plane.offset, /** @type {Vec3} */ (uniforms.u_light));
    const shadow = {
      ...uniforms, u_shadow: paletteOf(this.isDark).shadow,
      u_view_projection: multiply(/** @type {number[]} */ (uniforms.u_view_projection), flattened),
    };
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    this.colliders?.draw(shadow);
    if (this.toggles.surface) this.drawables?.cloth.drawShadow(shadow);
    // The flattening matrix scales w by its last element, and sizes in pixels are divided by w.
    this.drawSticks(shadow, { u_pixels_per_unit: /** @type {Float32Array} */ (uniforms.u_pixels_per_unit)[0] * flattened[15] });
    gl.disable(gl.STENCIL_TEST);
  }

  /** @param {Uniforms} uniforms */
  drawSolid(uniforms) {
    const { gl, simulation, drawables } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    // The triangles between particles that rest on a round solid cut into it a little.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(COLLIDER_BEHIND.slopes, COLLIDER_BEHIND.units);
    this.colliders?.draw(uniforms);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    const { ground } = simulation;
    for (const one of simulation.colliders) {
      if (one.shape !== "plane" || (ground !== null && one.offset === ground.offset && dot(one.normal, ground.normal) > 0.999)) continue;
      gl.depthMask(false);
      this.drawPlane(one, uniforms, this.camera.target);
      gl.depthMask(true);
    }
    if (this.buffers === null || drawables === null) return;
    if (this.toggles.surface) drawables.cloth.draw(uniforms);
    drawables.planks?.draw(uniforms);
    this.drawSticks(uniforms, STICKS.solid);
    this.drawPoints(uniforms, POINTS.solid);
  }

  /** Draws a 2-D scene without a depth test: later layers cover earlier ones. @param {Uniforms} uniforms */
  drawFlat(uniforms) {
    const { gl, drawables } = this;
    const palette = paletteOf(this.isDark);
    gl.disable(gl.DEPTH_TEST);
    this.colliders?.draw({ ...uniforms, u_flat: [...palette.collider, 0.55] });
    if (this.buffers === null || drawables === null) return;
    if (this.toggles.surface) drawables.cloth.draw(uniforms);
    this.drawSticks(uniforms, STICKS.flat);
    this.drawPoints(uniforms, POINTS.flat);
  }

  /** Sticks that a surface covers are drawn only on request. */
  areAllSticksDrawn() {
    return this.toggles.sticks || this.paint() === PAINT.kinds || !this.hasSurface() || !this.toggles.surface;
  }

  /** @param {Uniforms} uniforms @param {Uniforms} own uniforms that come before those */
  drawSticks(uniforms, own = STICKS.shadow) {
    this.drawables?.sticks.draw(uniforms, own);
  }

  /** @param {Uniforms} uniforms */
  drawGhost(uniforms) {
    const { buffers, simulation } = this;
    if (simulation.ghost === null || !buffers?.ghost) return;
    const isFlat = simulation.scene?.isPlanar ?? false;
    const color = paletteOf(this.isDark).ghost;
    buffers.ghost.draw(uniforms, buffers.positions, { isFlat, color, forward: isFlat ? 0 : 4e-4 });
  }

  /** @param {Uniforms} uniforms @param {{ forward: number, round: number }} style */
  drawPoints(uniforms, { forward, round }) {
    const { drawables, toggles, pointUniforms: own } = this;
    if (drawables === null) return;
    own.u_forward = forward;
    own.u_round = round;
    own.u_radius = uniforms.u_point_radius;
    own.u_radius_min = uniforms.u_point_min;
    if (toggles.particles) drawables.points.draw(drawables.points.particles, uniforms, own);
    if (!toggles.pins) return;
    own.u_radius_min = uniforms.u_mark_min;
    own.u_forward = forward * 2;
    drawables.points.draw(drawables.points.marks, uniforms, own);
    // A grabbed particle stays visible behind a fold.
    this.gl.disable(this.gl.DEPTH_TEST);
    drawables.points.draw(drawables.points.grabbed, uniforms, own);
  }

  /** @param {Uniforms} uniforms */
  drawForces(uniforms) {
    this.arrowsDrawn = this.toggles.forces && this.buffers !== null ? arrowsOf(this.simulation) : [];
    this.forceScale.follow(this.arrowsDrawn);
    const palette = paletteOf(this.isDark);
    const ratio = this.canvas.height / this.viewport.height;
    this.arrows?.set(this.arrowsDrawn, this.unitsPerNewton());
    this.arrows?.draw(uniforms, { width: ARROW_WIDTH * ratio, rim: ratio, color: palette.force, rimColor: palette.ring });
  }

  /** Length of a force arrow per newton. */
  unitsPerNewton() {
    return this.forceScale.unitsPerNewton(this.simulation.radius());
  }

  hasSurface() {
    return (this.simulation.scene?.triangleCount ?? 0) > 0;
  }
}
