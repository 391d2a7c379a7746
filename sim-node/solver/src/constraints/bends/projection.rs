//! The projection of bends.

use crate::constraints::fields::Pass;
use crate::constraints::projection::LaneIndex;
use crate::kernels::lanes::{Lanes, Lanes8, axes, map_axes};

/// The separation of a particle of a bend from its second particle b, with the particle's coefficient.
/// It is measured between particles, because a sum of rounded coordinates would lose the digits of C.
#[derive(Clone, Copy)]
pub(crate) struct Arm<L> {
    pub(crate) coefficient: L,
    /// x - `x_b` at the start of the substep.
    pub(crate) start: [L; 3],
    /// d - `d_b`.
    pub(crate) change: [L; 3],
}

/// C: the sum of c (x - `x_b`) over the arms.
#[inline(always)]
pub(crate) fn bend_value<L: Lanes, const N: usize>(arms: &[Arm<L>; N]) -> [L; 3] {
    axes(|axis| {
        let mut start = arms[0].coefficient * arms[0].start[axis];
        let mut change = arms[0].coefficient * arms[0].change[axis];
        for arm in &arms[1..] {
            start = start + arm.coefficient * arm.start[axis];
            change = change + arm.coefficient * arm.change[axis];
        }
        start + change
    })
}

/// Shape in which a hinge is at rest.
#[derive(Clone, Copy)]
pub(crate) struct HingeRest<L> {
    /// C along the normal.
    pub(crate) rest: L,
    /// Area of the first triangle / area of the second.
    pub(crate) area_ratio: L,
}

/// C - rest n / |n|, where n is the sum of the unit normals of the triangles.
///
/// The gradient of n is left out: it is across n, and so across C, as long as the triangles keep their shape.
#[inline(always)]
pub(crate) fn subtract_rest<L: Lanes>(
    value: [L; 3],
    arms: &[Arm<L>; 3],
    hinge: HingeRest<L>,
) -> [L; 3] {
    let side = |arm: &Arm<L>| axes(|axis| arm.start[axis] + arm.change[axis]);
    let [corner, edge, other] = [side(&arms[0]), side(&arms[1]), side(&arms[2])];
    let (first, second) = (cross(edge, corner), cross(other, edge));
    let normal = axes(|axis| first[axis] + hinge.area_ratio * second[axis]);
    let square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    // Triangles that lie on each other have no normal.
    let scale = (hinge.rest / square.sqrt()).masked(L::splat(0.0).is_below(square));
    axes(|axis| value[axis] - scale * normal[axis])
}

#[inline(always)]
fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The sum of w c^2 over the particles.
#[inline(always)]
pub(crate) fn bend_weight<L: Lanes, const N: usize>(
    coefficients: &[L; N],
    inverse_masses: &[L; N],
) -> L {
    let term = |index: usize| (coefficients[index] * coefficients[index]) * inverse_masses[index];
    let mut weight = term(0);
    for index in 1..N {
        weight = weight + term(index);
    }
    weight
}

/// Inputs of a pass over bends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BendPass {
    /// True in the first pass of a substep.
    pub(crate) is_first: bool,
    /// The multipliers are needed, because a substep has several passes.
    pub(crate) has_multipliers: bool,
    /// Fraction of each correction that is applied.
    pub(crate) share: f32,
}

impl BendPass {
    pub(crate) fn new(pass: Pass, share: f32) -> Self {
        Self { is_first: pass.is_first(), has_multipliers: pass.count > 1, share }
    }
}

/// The bends of a run.
///
/// With the multiplier Lambda, a vector, and a = alpha / h^2, its change is
/// `delta_Lambda` = -(C + a Lambda) / (sum of w c^2 + a), and a particle moves by
/// d += w c `delta_Lambda`. Lambda starts at 0 in each substep (XPBD: Macklin, Mueller, Chentanez 2016,
/// equation 18, for a constraint with the same gradient on each axis).
pub(crate) struct BendProjection<'a> {
    /// a in 1/kg. Infinite for a bend without effect.
    pub(crate) scaled_compliances: &'a [Lanes8],
    /// Lambda in kg m; None if a substep has a single pass.
    pub(crate) multipliers: Option<[&'a mut [Lanes8]; 3]>,
    /// True in the first pass of a substep, where Lambda is still 0.
    pub(crate) is_first: bool,
    /// Fraction of each correction that is applied.
    pub(crate) share: f32,
}

impl BendProjection<'_> {
    /// `delta_Lambda` for C and the sum of w c^2. It is 0 where the bend has no effect, no particle is free,
    /// or the state is not finite. It is always finite, so that a fixed particle never moves.
    #[inline(always)]
    pub(crate) fn change<L: Lanes>(
        &mut self,
        index: LaneIndex,
        value: [L; 3],
        weight: L,
    ) -> [L; 3] {
        let scaled_compliance = L::load(&self.scaled_compliances[index.group], index.lane);
        let before = match &self.multipliers {
            Some(multipliers) if !self.is_first => {
                axes(|axis| L::load(&multipliers[axis][index.group], index.lane))
            }
            _ => [L::splat(0.0); 3],
        };
        let residual = match &self.multipliers {
            Some(_) if !self.is_first => {
                axes(|axis| value[axis] + scaled_compliance * before[axis])
            }
            _ => value,
        };
        let scale = L::splat(-self.share) / (weight + scaled_compliance);
        let change = map_axes(residual, |axis| scale * axis);
        let size = change[0].abs() + change[1].abs() + change[2].abs();
        let is_finite = size.is_at_most(L::splat(f32::MAX));
        let is_valid = L::both(is_finite, L::splat(0.0).is_below(weight));
        let change = map_axes(change, |axis| axis.masked(is_valid));
        if let Some(multipliers) = &mut self.multipliers {
            for axis in 0..3 {
                let after = before[axis] + change[axis];
                after.store(&mut multipliers[axis][index.group], index.lane);
            }
        }
        change
    }

    /// Splits the run after `count` lane groups.
    pub(crate) fn split(self, count: usize) -> (Self, Self) {
        let Self { scaled_compliances, multipliers, is_first, share } = self;
        let (scaled_compliances, other_compliances) = scaled_compliances.split_at(count);
        let (multipliers, other_multipliers) = multipliers
            .map(|columns| {
                let [x, y, z] = columns.map(|column| column.split_at_mut(count));
                ([x.0, y.0, z.0], [x.1, y.1, z.1])
            })
            .unzip();
        let other = Self {
            scaled_compliances: other_compliances,
            multipliers: other_multipliers,
            is_first,
            share,
        };
        (Self { scaled_compliances, multipliers, is_first, share }, other)
    }
}
