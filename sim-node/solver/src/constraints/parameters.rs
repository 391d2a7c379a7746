//! The numbers by which a constraint acts, as the step uses them.

use super::separation::RestLength;

/// Parameters of one constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ConstraintParameters {
    /// Infinite if it is torn.
    pub(crate) rest: RestLength<f32>,
    /// Length above which it acts; -1 for always, because no length is below.
    pub(crate) floor: f32,
    pub(crate) softness: PassSoftness,
    pub(crate) limits: LimitLengths,
}

/// Lengths and multipliers at which a constraint stops stretching or tears; infinite for no limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LimitLengths {
    pub(crate) max_length: f32,
    pub(crate) tear_length: f32,
    /// Force times h^2.
    pub(crate) tear_multiplier: f32,
}

/// Softness of a constraint within one pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PassSoftness {
    /// xpbd: compliance / h^2, in 1/kg. pbd: 0.
    pub(crate) scaled_compliance: f32,
    /// Fraction of each correction that is applied: the relaxation factor, in pbd times k'.
    pub(crate) share: f32,
}

impl PassSoftness {
    pub(crate) const RIGID: Self = Self { scaled_compliance: 0.0, share: 1.0 };
}

impl Default for PassSoftness {
    fn default() -> Self {
        Self::RIGID
    }
}

impl LimitLengths {
    pub(crate) const NONE: Self = Self {
        max_length: f32::INFINITY,
        tear_length: f32::INFINITY,
        tear_multiplier: f32::INFINITY,
    };
}

impl ConstraintParameters {
    /// A constraint without effect: torn, or padding.
    pub(crate) const INACTIVE: Self = Self {
        rest: RestLength { length: f32::INFINITY, square: f32::INFINITY },
        floor: -1.0,
        softness: PassSoftness { scaled_compliance: 0.0, share: 0.0 },
        limits: LimitLengths::NONE,
    };
}
