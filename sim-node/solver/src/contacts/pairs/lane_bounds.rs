//! Boxes around points in eight lanes.

use crate::contacts::bounds::Bounds;
use crate::kernels::lanes::{Wide, axes, map_axes};

/// A box in each lane.
#[derive(Clone, Copy)]
pub(super) struct LaneBounds<W> {
    /// Smallest coordinates, negated.
    negated_min: [W; 3],
    max: [W; 3],
}

impl<W: Wide> LaneBounds<W> {
    #[inline(always)]
    pub(super) fn empty() -> Self {
        let least = W::splat(f32::NEG_INFINITY);
        Self { negated_min: [least; 3], max: [least; 3] }
    }

    /// Extends each box to a point. NaN leaves it as it is.
    #[inline(always)]
    pub(super) fn include(&mut self, point: [W; 3]) {
        for (axis, at) in point.into_iter().enumerate() {
            self.negated_min[axis] = (-at).max_or_rhs(self.negated_min[axis]);
            self.max[axis] = at.max_or_rhs(self.max[axis]);
        }
    }

    /// The box around the boxes of all lanes.
    #[inline(always)]
    pub(super) fn around_all(&self) -> Bounds {
        let min = map_axes(greatest(self.negated_min), |axis| -axis);
        Bounds { min, max: greatest(self.max) }
    }
}

/// The largest lane of each.
#[inline(always)]
fn greatest<W: Wide>([x, y, z]: [W; 3]) -> [f32; 3] {
    let larger = |[a, b]: [W; 2]| a.max_or_rhs(b);
    // Of pairs, then of fours: x, y, z, z and the same of the second four.
    let of_fours = larger(W::unzip(larger(W::unzip(x, y)), larger(W::unzip(z, z))));
    let mut lanes = [0.0; 8];
    of_fours.store(&mut lanes, 0);
    axes(|axis| if lanes[axis] > lanes[axis + 4] { lanes[axis] } else { lanes[axis + 4] })
}
