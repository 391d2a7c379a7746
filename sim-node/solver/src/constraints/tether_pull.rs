//! The correction by a tether, which pulls only.

use super::separation::{RestLength, Separation, correction};
use crate::kernels::lanes::{Lanes, map_axes};

/// A particle and its root, as a tether measures them.
#[derive(Clone, Copy)]
pub(crate) struct Tethered<L> {
    /// From the root at the end of the substep to the particle at its start.
    pub(crate) start: [L; 3],
    /// d of the particle.
    pub(crate) displacement: [L; 3],
    /// Largest distance to the root.
    pub(crate) limit: RestLength<L>,
    pub(crate) inverse_mass: L,
}

/// The part of the displacement by which a particle exceeds its tether; 0 for fixed particles. None if that is
/// 0 for all lanes, which saves the root and the division.
#[inline(always)]
pub(crate) fn tether_excess<L: Lanes>(tethered: Tethered<L>) -> Option<[L; 3]> {
    let Tethered { start, displacement, limit, inverse_mass } = tethered;
    let separation = Separation::new(start, displacement);
    let is_taut = limit.square.is_below(separation.squared.value());
    let is_free = L::splat(0.0).is_below(inverse_mass);
    let is_pulled = L::both(is_taut, is_free);
    if !L::any(is_pulled) {
        return None;
    }
    let scale = separation.squared.scale(limit, L::splat(1.0), L::splat(1.0));
    let excess = correction(separation.vector, scale).displacement(L::splat(1.0));
    Some(map_axes(excess, |axis| axis.masked(is_pulled)))
}
