//! Sheets and numbers for the tests of surfaces.

use sim_scene::model::Model;
use sim_scene::scene::Scene;

use super::super::load;
use super::surface::Surface;

/// Pseudo-random numbers.
pub(super) struct Random(pub(super) u32);

impl Random {
    /// A whole number below a limit.
    pub(super) fn below(&mut self, limit: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) % limit
    }

    /// A number from -1 to 1.
    pub(super) fn number(&mut self) -> f32 {
        self.below(1 << 16) as f32 / f32::from(1_u16 << 15) - 1.0
    }
}

/// A sheet of particles in a square.
pub(super) fn sheet(side: u32, spacing: f32) -> Model {
    let text = format!(
        "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = {side}\nrows = {side}\nspacing = {spacing}\n"
    );
    Scene::from_toml(&text, "test").unwrap().model()
}

/// The surface of a model, and its particles by slot.
pub(super) fn surface_of(model: &Model) -> (Surface, Vec<u32>) {
    let particles = load::slots(model);
    (Surface::new(model, &particles, load::triangles(model, &particles)), particles)
}
