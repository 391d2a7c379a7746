// The values of the uniforms in a picture. They follow from the camera, the scene and the toggles, and are written
// in place. Some passes, such as the shadow map, differ from the picture in a few of them.

import { add, identity, multiply, normalize, scale, scaleThenMove } from "../geometry/math.js";
import { includeSolids } from "../state/framing.js";
import { PAINT } from "./shaders.js";
import { clipBox, lightView } from "./shadow-map.js";
import { paletteOf, paletteUniforms } from "./theme.js";
import { SharedUniforms } from "./uniforms.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** The properties of the renderer that determine the values.
 * @typedef {{
 *   gl: WebGL2RenderingContext, canvas: HTMLCanvasElement, viewport: import("../geometry/camera.js").Viewport,
 *   camera: import("../geometry/camera.js").Camera, simulation: import("../state/simulation.js").Simulation,
 *   isDark: boolean, coloring: { low: number, high: number }, buffers?: { spacing: number, markGap: number } | null,
 *   toggles: { surface: boolean, sticks: boolean, heat: boolean, shadow: boolean },
 *   hasEffects(): boolean, hasSurface(): boolean, paint(): number,
 * }} Picture */

/** Distance of the lamp, in radii of the scene. */
const LAMP_RADII = 2.6;
/** Width of a thread of the weave, in distances between particles. */
const THREAD_SPACINGS = 0.25;
/** Reach of shadows around the target of the camera, in distances from it: a little more than the picture shows. */
const SHADOW_REACH = 1.2;
/** Scenes with more particles than a ragdoll are drawn with thinner sticks. */
const FEW_PARTICLES = 60;

/** A matrix that takes every point out of the shadow map, where everything is lit. */
const NOWHERE = scaleThenMove([-9, -9, 0], [0, 0, 0]);
/** Offset and scale of positions without a frame. */
const ORIGIN = [0, 0, 0];
const ONES = [1, 1, 1];
/** Offset of the ground plane in a scene without one: below everything. */
const ABYSS = -1e9;

/** Least radius of the mark of a particle in CSS pixels. Marks that are close together become smaller, so that they neither
 * merge into a bar nor hide what they hold. @param {number} count of particles @param {number} gap between marks in CSS pixels */
export function markRadius(count, gap) {
  const most = count > 2000 ? 4 : 5.5;
  return Math.min(most, Math.max(1.6, gap * 0.4));
}

export class PictureUniforms {
  /** @param {Picture} picture */
  constructor(picture) {
    this.picture = picture;
    /** The shared uniforms of the picture. */
    this.shared = new SharedUniforms(picture.gl);
    /** Those of a pass that differs from the picture. */
    this.pass = new SharedUniforms(picture.gl);
    /** The plain uniforms of sticks and points that follow from the scene and the toggles. */
    this.sceneStyles = {
      sticks: { u_radius: 0, u_radius_min: 0, u_opacity: 1, u_is_all: 1 },
      particles: { u_radius: 0, u_radius_min: 0 },
      marks: { u_radius: 0, u_radius_min: 0 },
      grabbed: { u_radius: 0, u_radius_min: 0 },
    };
    /** The matrix of the picture, in doubles. */
    this.viewProjection = identity();
    /** The direction towards the light, with the axes that it was computed for. @type {{ axes: import("../geometry/camera.js").Axes | null, direction: Vec3 }} */
    this.knownLight = { axes: null, direction: [0, 0, 0] };
    /** The view of the light; null without effects, or without anything near. @type {import("./shadow-map.js").LightView | null} */
    this.lightView = null;
    /** The palette that has been written. @type {import("./theme.js").Palette | null} */
    this.palette = null;
  }

  /** Creates the buffers: at first, and again after the context was lost. */
  create() {
    this.shared.create();
    this.pass.create();
  }

  /** Writes and uploads the values of the current picture. */
  update() {
    this.writeView();
    this.writeScene();
    this.writeColors();
    this.writeLight();
    this.setSceneStyles();
    this.shared.upload();
  }

  /** Begins a pass that differs from the picture in some shared uniforms. @param {Parameters<SharedUniforms["write"]>[0]} changes */
  beginPass(changes) {
    this.pass.copyFrom(this.shared);
    this.pass.write(changes);
    this.pass.upload();
  }

  /** Ends a pass: the next draws belong to the picture again. */
  endPass() {
    this.shared.bind();
  }

  writeView() {
    const { camera, canvas, viewport } = this.picture;
    const { members } = this.shared;
    const { right, up } = camera.basis();
    const projection = camera.projection(viewport.width / viewport.height);
    members.u_view_projection.set(multiply(projection, camera.view(), this.viewProjection));
    members.u_viewport[0] = canvas.width;
    members.u_viewport[1] = canvas.height;
    members.u_eye.set(camera.eye());
    members.u_right.set(right);
    members.u_upward.set(up);
    members.u_pixels_per_unit[0] = (projection[5] * canvas.height) / 2;
    members.u_near[0] = camera.isFlat ? 0 : camera.distance * 0.02;
  }

  writeScene() {
    const { buffers, camera, simulation } = this.picture;
    const { members } = this.shared;
    const { frame, ground, scene } = simulation;
    members.u_lo.set(frame?.lo ?? ORIGIN);
    members.u_scale.set(frame?.scale ?? ONES);
    members.u_particle_count[0] = scene?.particleCount ?? 0;
    members.u_thread[0] = (buffers?.spacing ?? 1) * THREAD_SPACINGS;
    members.u_is_solid[0] = this.picture.hasEffects() ? 1 : 0;
    members.u_ground.set(ground?.normal ?? camera.axes.up);
    members.u_ground[3] = ground?.offset ?? ABYSS;
  }

  /** Writes the colours. Those of the palette change only with the theme. */
  writeColors() {
    const { camera, coloring, isDark, toggles } = this.picture;
    const { members } = this.shared;
    const palette = paletteOf(isDark);
    const hasSurface = this.picture.hasSurface();
    if (this.palette !== palette) this.shared.write(paletteUniforms(isDark));
    this.palette = palette;
    members.u_paint[0] = this.picture.paint();
    members.u_heat_low[0] = coloring.low;
    members.u_heat_high[0] = coloring.high;
    members.u_stick.set(camera.isFlat && hasSurface ? palette.flatStick : palette.stick);
    // A dark ball is invisible on the dark end of the heat map.
    members.u_particle.set(toggles.heat && toggles.surface && hasSurface ? palette.ring : palette.particle);
  }

  /** Writes the light, and where its shadows fall. */
  writeLight() {
    const { camera, simulation } = this.picture;
    const { members } = this.shared;
    const light = this.light();
    this.lightView = this.viewOfLight(light);
    members.u_up.set(camera.axes.up);
    // Close enough that a flat cloth is not uniformly lit. The shadow treats the light as distant.
    const distance = simulation.radius() * LAMP_RADII;
    const middle = simulation.middle();
    for (let axis = 0; axis < 3; axis++) members.u_lamp[axis] = middle[axis] + light[axis] * distance;
    members.u_to_shadow_map.set(this.lightView?.map ?? NOWHERE);
    members.u_texel[0] = this.lightView?.texel ?? 0;
  }

  /** The direction towards the light, which depends only on the axes of the scene. */
  light() {
    const { axes } = this.picture.camera;
    if (this.knownLight.axes !== axes) this.knownLight = { axes, direction: normalize(add(add(scale(axes.up, 0.8), scale(axes.toward, 0.62)), scale(axes.right, -0.5))) };
    return this.knownLight.direction;
  }

  /** The view of the light, onto what is near the picture; null without effects. @param {Vec3} light */
  viewOfLight(light) {
    const { simulation, camera, toggles } = this.picture;
    if (!this.picture.hasEffects() || !toggles.shadow || simulation.frame === null) return null;
    const { min, max } = simulation.frame.bounds;
    const box = { min: /** @type {Vec3} */ ([...min]), max: /** @type {Vec3} */ ([...max]) };
    includeSolids(box, simulation);
    const near = clipBox(box, camera.target, camera.distance * SHADOW_REACH);
    return near === null ? null : lightView(light, near);
  }

  /** Sets the radii of sticks and points, a fraction of the spacing between particles but always visible, and which
   * sticks are drawn how opaque. */
  setSceneStyles() {
    const { buffers, camera, canvas, simulation, toggles, viewport } = this.picture;
    const { sticks, particles, marks, grabbed } = this.sceneStyles;
    const hasSurface = this.picture.hasSurface();
    const ratio = canvas.height / viewport.height;
    const spacing = buffers?.spacing ?? simulation.radius() * 0.5;
    const count = simulation.scene?.particleCount ?? 0;
    const thick = Math.min(spacing * 0.13, simulation.radius() * (count > FEW_PARTICLES ? 0.006 : 0.02));
    // Sticks that a surface covers are drawn only on request.
    const isAll = toggles.sticks || this.picture.paint() === PAINT.kinds || !hasSurface || !toggles.surface;
    sticks.u_radius = hasSurface && !camera.isFlat ? 0 : hasSurface ? thick * 0.5 : thick;
    sticks.u_radius_min = (hasSurface ? 0.6 : 1.1) * ratio;
    sticks.u_opacity = hasSurface && !camera.isFlat ? 0.75 : 1;
    sticks.u_is_all = isAll ? 1 : 0;
    particles.u_radius = marks.u_radius = grabbed.u_radius = hasSurface ? 0 : thick * 1.5;
    particles.u_radius_min = (hasSurface ? 1.8 : count < 20 ? 6 : 2.4) * ratio;
    grabbed.u_radius_min = markRadius(count, Infinity) * ratio;
    const gap = (buffers?.markGap ?? Infinity) / camera.unitsPerPixel(camera.target, viewport);
    marks.u_radius_min = markRadius(count, gap) * ratio;
  }
}
