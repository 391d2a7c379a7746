//! The axes of a box or mesh at one moment.

use glam::{Quat, Vec3};

use super::path::SubstepPath;

/// Position and rotation of a box or mesh.
#[derive(Debug, Clone)]
pub(crate) struct PlacedFrame {
    pub(crate) center: Vec3,
    rotation: Quat,
    inverse: Quat,
    pub(crate) is_turned: bool,
}

impl PlacedFrame {
    pub(crate) fn new(center: Vec3, rotation: Quat) -> Self {
        let (inverse, is_turned) = (rotation.conjugate(), rotation != Quat::IDENTITY);
        Self { center, rotation, inverse, is_turned }
    }

    /// A direction in these axes.
    pub(crate) fn to_local(&self, vector: Vec3) -> Vec3 {
        if self.is_turned { self.inverse * vector } else { vector }
    }

    /// A direction in the axes of the scene.
    pub(crate) fn to_scene(&self, vector: Vec3) -> Vec3 {
        if self.is_turned { self.rotation * vector } else { vector }
    }

    /// A unit vector in the axes of the scene.
    pub(crate) fn unit_to_scene(&self, normal: Vec3) -> Vec3 {
        if self.is_turned { (self.rotation * normal).normalize() } else { normal }
    }

    /// A point in these axes.
    pub(crate) fn local(&self, point: Vec3) -> Vec3 {
        self.to_local(point - self.center)
    }

    /// The end of a path in these axes. The displacement is added last: near the surface the rest is
    /// exact, so the displacement keeps its digits.
    pub(crate) fn local_end(&self, path: &SubstepPath) -> Vec3 {
        self.local(path.start) + self.to_local(path.displacement)
    }
}
