//! Particles side by side, and what the stages of single particles do to them.

use glam::Vec3;

use super::prediction::Prediction;
use crate::contacts::path::{LanePath, SubstepPath};
use crate::kernels::lanes::Wide;

/// Particles side by side: a row of a sheet or a crowd, or a block of the graph.
pub(crate) trait ParticleBlock {
    /// Number of groups of eight. The last one may have padding, whose inverse mass is 0.
    fn group_count(&self) -> usize;
    /// Number of the first particle. Two blocks may share numbers, which costs
    /// only time.
    fn first(&self) -> usize;
    fn inverse_mass(&self, index: usize) -> f32;
    fn path(&self, index: usize) -> SubstepPath;
    /// Displacement before any constraint or contact; 0 in a scene without bounces.
    fn predicted(&self, index: usize) -> Vec3;
    fn set_displacement(&mut self, index: usize, displacement: Vec3);
    /// Paths of the particles 8 `group`, ..., 8 `group` + 7; likewise below.
    fn paths<W: Wide>(&self, group: usize) -> LanePath<W>;
    fn inverse_masses<W: Wide>(&self, group: usize) -> W;
    fn predicted_lanes<W: Wide>(&self, group: usize) -> [W; 3];
    fn set_displacements<W: Wide>(&mut self, group: usize, displacements: [W; 3]);
    fn set_paths<W: Wide>(&mut self, group: usize, paths: &LanePath<W>);
    /// d = h v for free particles.
    fn predict<W: Wide>(&mut self, prediction: &Prediction);
    /// Shortens d of free particles beyond the length of their tether.
    fn pull_to_roots<W: Wide>(&mut self);
    /// x += d.
    fn advance<W: Wide>(&mut self);
}
