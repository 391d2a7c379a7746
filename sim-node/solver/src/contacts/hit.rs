//! Where a particle leaves a collider.

use glam::Vec3;

/// The point at which a particle leaves a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Unit vector out of the collider.
    pub(crate) normal: Vec3,
    /// Depth of the particle inside the collider, along the normal, > 0.
    pub(crate) depth: f32,
}
