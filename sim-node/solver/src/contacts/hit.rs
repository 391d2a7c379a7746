//! Where a particle leaves a collider.

use glam::Vec3;

use crate::kernels::lanes::Lanes;

/// The point at which a particle leaves a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Unit vector out of the collider.
    pub(crate) normal: Vec3,
    /// Depth of the particle inside the collider, along the normal, > 0.
    pub(crate) depth: f32,
}

/// The points at which one particle or eight leave a collider.
#[derive(Clone, Copy)]
pub(crate) struct LaneHit<L: Lanes> {
    /// Set for particles inside. The other lanes hold any numbers.
    pub(crate) is_hit: L::Mask,
    pub(crate) normal: [L; 3],
    pub(crate) depth: L,
}

impl LaneHit<f32> {
    pub(crate) fn to_hit(self) -> Option<Hit> {
        self.is_hit.then(|| Hit { normal: Vec3::from_array(self.normal), depth: self.depth })
    }
}
