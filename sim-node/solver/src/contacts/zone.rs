//! Zones: cheap bounds of solids, tested for eight particles at a time.

use glam::Vec3;

use crate::kernels::lanes::{Lanes, map_axes};

/// Conservative bound of a solid: a path that misses the zone cannot hit the solid.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Zone {
    /// The half-space normal x < offset.
    Below { normal: Vec3, offset: f32 },
    /// An axis-aligned box around the solid.
    Around { min: Vec3, max: Vec3 },
}

impl Zone {
    /// Everything within a distance of two points, enlarged by the rounding of numbers of the size
    /// of `reach`.
    pub(crate) fn around(points: [Vec3; 2], distance: Vec3, reach: f32) -> Self {
        let distance = distance + Vec3::splat(64.0 * f32::EPSILON * reach);
        let ([a, b], mut min, mut max) = (points, Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            let (low, high) = if a[axis] < b[axis] { (a, b) } else { (b, a) };
            (min[axis], max[axis]) = (low[axis] - distance[axis], high[axis] + distance[axis]);
        }
        Self::Around { min, max }
    }

    /// True if the path from x to x + d may enter the zone.
    #[inline(always)]
    pub(crate) fn may_meet<L: Lanes>(&self, x: [L; 3], d: [L; 3]) -> L::Mask {
        match self {
            // The same arithmetic as in `hit_half_space`.
            Self::Below { normal, offset } => {
                let normal = map_axes(normal.to_array(), L::splat);
                let along = |vector: [L; 3]| {
                    normal[0] * vector[0] + normal[1] * vector[1] + normal[2] * vector[2]
                };
                ((along(x) - L::splat(*offset)) + along(d)).is_below(L::splat(0.0))
            }
            Self::Around { min, max } => {
                let meets = |axis: usize| {
                    let (start, end) = (x[axis], x[axis] + d[axis]);
                    let is_down = end.is_below(start);
                    let low = L::select(is_down, end, start);
                    let high = L::select(is_down, start, end);
                    let (min, max) = (L::splat(min[axis]), L::splat(max[axis]));
                    L::both(low.is_at_most(max), min.is_at_most(high))
                };
                L::both(L::both(meets(0), meets(1)), meets(2))
            }
        }
    }
}
