//! The prediction of a substep: inertia, gravity, damping, wind and the speed limit.

use crate::kernels::lanes::{Lanes, axes, map_axes};

/// The prediction of a substep, the same for every particle.
///
/// v' = max(0, 1 - c h) v + h a, |v'| <= `max_speed`, d' = h v'. In the first substep of a step the
/// displacement field holds the velocity. Later substeps continue from d = h v without dividing it
/// by h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Prediction {
    /// Length of the substep in seconds.
    pub(crate) h: f32,
    /// Fraction of the velocity that damping leaves: max(0, 1 - c h).
    pub(crate) kept: f32,
    /// h a.
    pub(crate) gain: [f32; 3],
    /// `max_speed` h.
    pub(crate) reach: f32,
    /// True in the first substep of a step.
    pub(crate) is_first: bool,
}

impl Prediction {
    /// Displacement that follows the previous one, or the velocity in the first substep. `wind` is
    /// the velocity that the wind adds. Fixed particles keep the displacement they were driven to.
    #[inline(always)]
    pub(crate) fn predict<L: Lanes>(&self, before: [L; 3], wind: [L; 3], w: L) -> [L; 3] {
        let (kept, h) = (L::splat(self.kept), L::splat(self.h));
        let gain = axes(|axis| L::splat(self.gain[axis]) + wind[axis]);
        let mut after = if self.is_first {
            axes(|axis| h * (kept * before[axis] + gain[axis]))
        } else {
            axes(|axis| kept * before[axis] + h * gain[axis])
        };
        let squared = after[0] * after[0] + after[1] * after[1] + after[2] * after[2];
        let reach = L::splat(self.reach);
        let is_fast = (reach * reach).is_below(squared);
        if L::any(is_fast) {
            // A square beyond f32 has lost the direction: the state has blown up.
            let is_finite = squared.is_at_most(L::splat(f32::MAX));
            let scale = L::select(is_finite, reach / squared.sqrt(), L::splat(f32::NAN));
            after = map_axes(after, |axis| L::select(is_fast, axis * scale, axis));
        }
        let is_free = L::splat(0.0).is_below(w);
        axes(|axis| L::select(is_free, after[axis], before[axis]))
    }
}
