//! Sheets that touch themselves and obstacles.

use sim_solver::Scene;

/// A sheet with contacts.
#[derive(Debug)]
pub(crate) struct TouchingSheet<'a> {
    pub(crate) rate_hz: u32,
    pub(crate) substeps: u32,
    /// Mode of contact.
    pub(crate) mode: &'a str,
    /// Number of particles on each side.
    pub(crate) side: u32,
    /// Distance of neighbours in m, which is also the contact distance.
    pub(crate) spacing: f64,
    pub(crate) origin: [f64; 3],
    pub(crate) right: [f64; 3],
    pub(crate) down: [f64; 3],
    /// Tables of the scene.
    pub(crate) colliders: String,
}

impl TouchingSheet<'_> {
    pub(crate) fn scene(&self) -> Scene {
        let Self { rate_hz, substeps, mode, side, spacing, origin, right, down, colliders } = self;
        let text = format!(
            "version = 1\n[solver]\nrate_hz = {rate_hz}\nsubsteps = {substeps}\n[contact]\nmode = \"{mode}\"\n\
             [[generate]]\nshape = \"mesh\"\ncolumns = {side}\nrows = {side}\nspacing = {spacing}\nmass = 0.001\n\
             compliance = {{ bend = 1e-3 }}\norigin = {origin:?}\nright = {right:?}\ndown = {down:?}\n{colliders}"
        );
        Scene::from_toml(&text, "touching").unwrap()
    }
}

/// A plane with friction.
pub(crate) fn ground(height: f64) -> String {
    format!(
        "[[collider]]\nshape = \"plane\"\nnormal = [0, 1, 0]\noffset = {height}\nfriction = 0.3\n"
    )
}

/// A ball with friction above the origin.
pub(crate) fn ball(height: f64, radius: f64) -> String {
    format!(
        "[[collider]]\nshape = \"sphere\"\ncenter = [0, {height}, 0]\nradius = {radius}\nfriction = 0.3\n"
    )
}
