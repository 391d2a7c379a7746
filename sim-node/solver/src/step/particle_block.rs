//! Particles side by side, and what the stages of single particles do to them.

use glam::Vec3;

use super::prediction::Prediction;
use crate::contacts::path::SubstepPath;
use crate::contacts::zone::Zone;
use crate::kernels::lanes::Wide;

/// Particles side by side: a row of a sheet, or a block of the graph.
pub(crate) trait ParticleBlock {
    fn count(&self) -> usize;
    /// Number of the first particle. Two blocks may share numbers, which costs
    /// only time.
    fn first(&self) -> usize;
    fn inverse_mass(&self, index: usize) -> f32;
    fn path(&self, index: usize) -> SubstepPath;
    /// Displacement before any constraint or contact.
    fn predicted(&self, index: usize) -> Vec3;
    fn set_displacement(&mut self, index: usize, displacement: Vec3);
    fn set_position(&mut self, index: usize, position: Vec3);
    /// True if any of the particles 8 `group`, ..., 8 `group` + 7 may enter a zone.
    fn may_touch<W: Wide>(&self, group: usize, zone: &Zone) -> bool;
    /// d = h v for free particles.
    fn predict<W: Wide>(&mut self, prediction: &Prediction);
    /// Shortens d of free particles beyond the length of their tether.
    fn pull_to_roots<W: Wide>(&mut self);
    /// x += d.
    fn advance<W: Wide>(&mut self);
}
