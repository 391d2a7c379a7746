//! The path of a particle in a substep.

use glam::Vec3;

/// A straight path from x to x + d.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SubstepPath {
    /// x.
    pub(crate) start: Vec3,
    /// d.
    pub(crate) displacement: Vec3,
}

/// The paths of one particle or eight.
#[derive(Clone, Copy)]
pub(crate) struct LanePath<L> {
    /// x.
    pub(crate) start: [L; 3],
    /// d.
    pub(crate) displacement: [L; 3],
}

impl From<&SubstepPath> for LanePath<f32> {
    fn from(path: &SubstepPath) -> Self {
        Self { start: path.start.to_array(), displacement: path.displacement.to_array() }
    }
}
