//! Zones: cheap bounds of solids, tested for eight particles at a time.

use glam::Vec3;

use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{dot, splat};

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
            // The same arithmetic as in `HalfSpace::height`.
            Self::Below { normal, offset } => {
                let normal = splat(normal.to_array());
                ((dot(normal, x) - L::splat(*offset)) + dot(normal, d)).is_below(L::splat(0.0))
            }
            Self::Around { min, max } => {
                let meets_x = meets(x[0], d[0], [min.x, max.x]);
                let meets_y = meets(x[1], d[1], [min.y, max.y]);
                let meets_z = meets(x[2], d[2], [min.z, max.z]);
                L::both(L::both(meets_x, meets_y), meets_z)
            }
        }
    }
}

/// True if the path from `start` by `displacement` may enter a range, on one axis. (As a closure it would
/// compile to a call.)
#[inline(always)]
fn meets<L: Lanes>(start: L, displacement: L, [min, max]: [f32; 2]) -> L::Mask {
    let end = start + displacement;
    let is_down = end.is_below(start);
    let (low, high) = (L::select(is_down, end, start), L::select(is_down, start, end));
    L::both(low.is_at_most(L::splat(max)), L::splat(min).is_at_most(high))
}
