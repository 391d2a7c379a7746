//! Solids whose contacts are computed for eight particles at a time.

use glam::Vec3;

use crate::contacts::hit::LaneHit;
use crate::contacts::path::LanePath;
use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{difference, divided, dot, select, splat, sum};

/// A solid whose contacts are computed for eight particles at a time.
pub(crate) trait LaneSolid {
    /// True for a path that ends inside. It costs less than [`Self::hit`], which most particles do not
    /// need.
    fn is_inside<L: Lanes>(&self, path: &LanePath<L>) -> L::Mask;

    /// Finds where particles leave the solid, if their paths end inside.
    fn hit<L: Lanes>(&self, path: &LanePath<L>) -> LaneHit<L>;
}

/// The solid lies where normal x < offset.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HalfSpace {
    pub(crate) normal: Vec3,
    pub(crate) offset: f32,
}

/// A solid sphere.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SolidSphere {
    pub(crate) center: Vec3,
    pub(crate) radius: f32,
    /// Normal at the exact center.
    pub(crate) pole: Vec3,
}

impl HalfSpace {
    /// The displacement is added last: near the surface the rest is exact, so the displacement keeps
    /// its digits.
    #[inline(always)]
    fn height<L: Lanes>(&self, path: &LanePath<L>) -> L {
        let normal = splat(self.normal.to_array());
        (dot(normal, path.start) - L::splat(self.offset)) + dot(normal, path.displacement)
    }
}

impl LaneSolid for HalfSpace {
    #[inline(always)]
    fn is_inside<L: Lanes>(&self, path: &LanePath<L>) -> L::Mask {
        self.height(path).is_below(L::splat(0.0))
    }

    #[inline(always)]
    fn hit<L: Lanes>(&self, path: &LanePath<L>) -> LaneHit<L> {
        let normal = splat(self.normal.to_array());
        LaneHit { is_hit: self.is_inside(path), normal, depth: -self.height(path) }
    }
}

impl SolidSphere {
    /// From the center to the end of the path.
    #[inline(always)]
    fn arm<L: Lanes>(&self, path: &LanePath<L>) -> [L; 3] {
        sum(difference(path.start, splat(self.center.to_array())), path.displacement)
    }
}

impl LaneSolid for SolidSphere {
    #[inline(always)]
    fn is_inside<L: Lanes>(&self, path: &LanePath<L>) -> L::Mask {
        let arm = self.arm(path);
        // NaN compares false and touches nothing.
        dot(arm, arm).is_below(L::splat(self.radius * self.radius))
    }

    #[inline(always)]
    fn hit<L: Lanes>(&self, path: &LanePath<L>) -> LaneHit<L> {
        let arm = self.arm(path);
        let square = dot(arm, arm);
        let (distance, radius) = (square.sqrt(), L::splat(self.radius));
        let is_at_center = square.is_below(L::splat(f32::MIN_POSITIVE));
        let normal = select(is_at_center, splat(self.pole.to_array()), divided(arm, distance));
        let is_hit = L::both(self.is_inside(path), distance.is_below(radius));
        LaneHit { is_hit, normal, depth: radius - distance }
    }
}
