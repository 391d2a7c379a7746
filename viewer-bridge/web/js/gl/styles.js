// The plain uniforms: those outside of the shared block, which differ between the draws of a pass. They are built
// once, because a new object in each picture would be garbage.

import { PAINT } from "./shaders.js";
import { paletteOf } from "./theme.js";

/** Colours of the solids. If the alpha of `flat` is above 0, they are unlit. Boxes drawn as lines have the colour `edges`, and are left out without it.
 * @typedef {{ collider: number[], pole: number[], flat: number[], edges: number[] | null }} ColliderStyle */

/** Depth by which sticks come forward, and how much they are shaded like rods. */
export const STICKS = Object.freeze({
  solid: { u_forward: 4e-4, u_round: 1 },
  flat: { u_forward: 0, u_round: 0.35 },
  /** As casters of a shadow onto the ground. */
  shadow: { u_forward: 0, u_round: 1 },
  /** In the shadow map, where they are at least about a texel wide. */
  mapped: { u_forward: 0, u_round: 1, u_radius_min: 0.7 },
});

/** The same for points. Marks lie in front of particles. */
export const POINTS = Object.freeze({
  solid: { particles: { u_forward: 1.2e-3, u_round: 1 }, marks: { u_forward: 2.4e-3, u_round: 1 } },
  flat: { particles: { u_forward: 0, u_round: 0.6 }, marks: { u_forward: 0, u_round: 0.6 } },
});

/** No flat colour: the surface is lit. */
const LIT = [0, 0, 0, 0];

/** @param {import("./theme.js").Palette} palette */
const fromPalette = ({ backdropTop, backdropBottom, flatSurface, collider, pole, ghost }) => ({
  backdrop: { u_top: backdropTop, u_bottom: backdropBottom },
  cloth: { solid: { u_flat: LIT }, flat: { u_flat: [...flatSurface, 0.85] } },
  colliders: {
    solid: { collider, pole, flat: LIT, edges: [...collider, 1] },
    flat: { collider, pole, flat: [...collider, 0.55], edges: null },
    shadow: { collider, pole, flat: LIT, edges: null },
  },
  /** Changes of the shared uniforms for a ghost, whose positions are not quantised. */
  ghost: { u_lo: [0, 0, 0], u_scale: [1, 1, 1], u_paint: PAINT.off, u_is_solid: 0, u_stick: ghost, u_stick_faint: ghost },
});
const STYLES = { light: fromPalette(paletteOf(false)), dark: fromPalette(paletteOf(true)) };

/** @param {boolean} isDark */
export const stylesOf = (isDark) => (isDark ? STYLES.dark : STYLES.light);
