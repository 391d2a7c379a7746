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
