//! How free particles move in a substep, but for what holds and stops them.

use crate::contact::Obstacle;
use crate::kernels::{Lanes, axes, each};
use crate::project::{Gap, Rest, correction};

/// What a substep does beside its constraints.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion<'a> {
    pub(crate) fall: Fall,
    /// In the order in which they are met.
    pub(crate) obstacles: &'a [Obstacle],
}

/// The prediction of a substep: the same for every particle.
///
/// v' = max(0, 1 - c h) v + h a, |v'| <= `max_speed`, d' = h v'. The first substep of a step has
/// the velocity in the place of the displacement; in the others v is d / h, and d is carried on as
/// it is, so that no division comes between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fall {
    /// Seconds.
    pub(crate) h: f32,
    /// The share of the velocity that damping leaves: max(0, 1 - c h).
    pub(crate) kept: f32,
    /// h a.
    pub(crate) gain: [f32; 3],
    /// `max_speed` h.
    pub(crate) reach: f32,
    /// It is the first substep of its step.
    pub(crate) is_first: bool,
}

impl Fall {
    /// The displacement that follows on one (on a velocity, in the first substep), for a particle of
    /// inverse mass w to which the wind gives a velocity. Fixed particles keep theirs.
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
            // A speed whose square is beyond f32 has no direction left: the state has blown up.
            let is_known = squared.is_at_most(L::splat(f32::MAX));
            let scale = L::choose(is_known, reach / squared.sqrt(), L::splat(f32::NAN));
            after = each(after, |along| L::choose(is_fast, along * scale, along));
        }
        let is_free = L::splat(0.0).is_below(w);
        axes(|axis| L::choose(is_free, after[axis], before[axis]))
    }
}

/// What a tether takes from the displacement of a particle that is further from its root than it may
/// be. `start` is the way from where the root is at the end of the substep to where the particle was
/// at its start.
#[inline(always)]
pub(crate) fn pull_back<L: Lanes>(start: [L; 3], moved: [L; 3], rest: Rest<L>, w: L) -> [L; 3] {
    let gap = Gap::new(start, moved);
    let scale = gap.size.scale(rest, L::splat(1.0), L::splat(1.0));
    let is_taut = rest.square.is_below(gap.size.squared());
    let is_free = L::splat(0.0).is_below(w);
    let is_pulled = L::both(is_taut, is_free);
    let way = correction(gap.separation, scale).way(L::splat(1.0));
    each(way, |along| along.only(is_pulled))
}
