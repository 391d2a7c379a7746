//! The vector between two particles, its length without cancellation, and the correction along it.

use crate::kernels::lanes::{Lanes, map_axes};
use crate::kernels::vectors::{dot, sum};

/// The vector r from particle a to particle b at the current point of a substep.
#[derive(Clone, Copy)]
pub(crate) struct Separation<L> {
    /// r.
    pub(crate) vector: [L; 3],
    pub(crate) squared: SquaredLength<L>,
}

/// |r|^2 as the sum of two parts, |r|^2 = base + change.
///
/// In small substeps h^2 g is as small as one rounding of |r|, and a force lambda / h^2 computed
/// from |r| would be noise. With R = `x_b` - `x_a` at the start of the substep and D = `d_b` - `d_a`,
/// base is |R|^2, and change is (R + r) D, which keeps all of its digits beside it.
#[derive(Clone, Copy)]
pub(crate) struct SquaredLength<L> {
    pub(crate) base: L,
    pub(crate) change: L,
}

/// Fraction of |R|^2 below which base and change have cancelled to noise: |r| is then less than a
/// thousandth of |R|.
const NOISE_FRACTION: f32 = 1.0 / (1 << 20) as f32;

impl<L: Lanes> Separation<L> {
    /// From R, the separation at the start of the substep, and D, the change since.
    #[inline(always)]
    pub(crate) fn new(start: [L; 3], change: [L; 3]) -> Self {
        let vector = sum(start, change);
        let squared =
            SquaredLength { base: dot(start, start), change: dot(sum(start, vector), change) };
        Self { vector, squared }
    }
}

impl<L: Lanes> SquaredLength<L> {
    /// |r|^2, at least the noise level, so that noise does not push coincident ends apart.
    #[inline(always)]
    pub(crate) fn value(&self) -> L {
        (L::splat(NOISE_FRACTION) * self.base).max_or_rhs(self.base + self.change)
    }

    /// |r|^2 - L^2.
    #[inline(always)]
    pub(crate) fn excess(&self, square: L) -> L {
        (self.base - square) + self.change
    }

    /// -`delta_lambda` / |r| of a rigid constraint, with a single division: C = (|r|^2 - L^2) /
    /// (|r| + L), so numerator and denominator of (C / w) / |r| are multiplied by |r| + L.
    ///
    /// NaN where there is no correction; see [`divide`].
    #[inline(always)]
    pub(crate) fn scale(&self, rest: RestLength<L>, weight: L, share: L) -> L {
        let length = self.value().sqrt();
        divide(share * self.excess(rest.square), weight * ((length + rest.length) * length))
    }
}

/// Divides by the weight of a correction.
///
/// NaN means *no correction*: both ends are fixed, the ends coincide and have no direction, the
/// constraint is torn (its rest length is infinite), or the state is not finite. Any other result
/// is finite, so that an end of inverse mass 0 never moves, whatever happens to the other end.
#[inline(always)]
pub(crate) fn divide<L: Lanes>(numerator: L, weight: L) -> L {
    let is_enough = L::splat(f32::MIN_POSITIVE).is_at_most(weight);
    let scale = L::splat(-f32::MAX).max_or_rhs(numerator / weight);
    L::select(is_enough, scale, L::splat(f32::NAN))
}

/// Correction for a scale. A scale of NaN gives a correction of 0, so that a state that blows up
/// affects neither its neighbours nor fixed particles.
#[inline(always)]
pub(crate) fn correction<L: Lanes>(vector: [L; 3], scale: L) -> Correction<L> {
    let is_valid = scale.is_not_nan();
    let vector = map_axes(vector, |axis| axis.masked(is_valid));
    Correction { vector, scale: scale.masked(is_valid) }
}

/// A correction: an end of inverse mass w moves by w scale r, the other end in reverse.
#[derive(Clone, Copy)]
pub(crate) struct Correction<L> {
    vector: [L; 3],
    scale: L,
}

impl<L: Lanes> Correction<L> {
    /// Displacement of the first end for an inverse mass; that of the second end is its negative.
    #[inline(always)]
    pub(crate) fn displacement(&self, inverse_mass: L) -> [L; 3] {
        let scale = inverse_mass * self.scale;
        map_axes(self.vector, |axis| scale * axis)
    }
}

/// The length that a constraint restores, with its square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RestLength<L> {
    pub(crate) length: L,
    pub(crate) square: L,
}

impl RestLength<f32> {
    pub(crate) fn new(length: f32) -> Self {
        Self { length, square: length * length }
    }
}
