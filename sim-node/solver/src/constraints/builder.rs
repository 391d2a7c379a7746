//! Derives the parameters of constraints from the scene and its parameters.

use std::cell::Cell;

use sim_scene::constraints::Constraint;
use sim_scene::model::Model;
use sim_scene::scene::Limits;
use sim_types::{ConstraintKind, Method, Parameter, TearCause};

use super::fields::ConstraintFields;
use super::parameters::{ConstraintParameters, LimitLengths, PassSoftness};
use super::projection::TearMark;
use super::separation::RestLength;
use crate::parameters::Parameters;

/// Builds the parameters of each constraint.
pub(crate) struct ConstraintBuilder<'a> {
    pub(crate) model: &'a Model,
    pub(crate) parameters: &'a Parameters,
    setup: Setup,
    relaxation: f32,
    iterations: u32,
    /// By kind: the softness that replaces that of its constraints.
    softness: [Option<f32>; ConstraintKind::ALL.len()],
    /// By kind: the previous stiffness, and its share per pass. The root is expensive, and most
    /// constraints have the stiffness of the one of their kind before.
    last_shares: [Cell<(f32, f32)>; ConstraintKind::ALL.len()],
    /// Limits of the constraint before, with their index in the model.
    last_limits: Cell<Option<(u32, Limits)>>,
}

/// Values that are fixed while a scene runs, or follow from the rate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Setup {
    pub(crate) method: Method,
    /// Length of a substep in seconds.
    pub(crate) h: f32,
}

impl<'a> ConstraintBuilder<'a> {
    pub(crate) fn new(model: &'a Model, parameters: &'a Parameters, setup: Setup) -> Self {
        let last_shares = ConstraintKind::ALL.map(|_| Cell::new((f32::NAN, f32::NAN)));
        Self {
            model,
            parameters,
            setup,
            relaxation: parameters.values.number(Parameter::Relaxation),
            iterations: parameters.values.count(Parameter::Iterations),
            softness: parameters.values.softness(),
            last_shares,
            last_limits: Cell::new(None),
        }
    }

    /// Number of passes in a substep.
    pub(crate) fn pass_count(&self) -> u32 {
        self.iterations
    }

    /// Builds the parameters of a constraint that is not torn.
    pub(crate) fn build(&self, index: u32) -> ConstraintParameters {
        let constraint = self.model.constraints[index as usize];
        let is_tether = constraint.kind == ConstraintKind::Tether;
        ConstraintParameters {
            rest: self.rest(constraint),
            floor: if is_tether { constraint.rest_length } else { -1.0 },
            softness: self.softness(constraint),
            limits: self.limit_lengths(index),
        }
    }

    /// Scaled compliance of a bend whose path is not torn.
    pub(crate) fn bend_compliance(&self, index: u32) -> f32 {
        let bend = self.model.bends[index as usize];
        bend.scaled_compliance(self.parameters.rigidity(&bend), self.setup.h)
    }

    /// Builds only the limits of a constraint that is not torn.
    pub(crate) fn limit_lengths(&self, index: u32) -> LimitLengths {
        let rest_length = self.model.constraints[index as usize].rest_length;
        let limits = self.limits(index);
        let TearLengths { by_stretch, by_distance } = TearLengths::new(&limits, rest_length);
        let force = limits.tear_force.unwrap_or(f32::INFINITY);
        LimitLengths {
            max_length: ratio_length(limits.max_stretch, rest_length),
            tear_length: if by_stretch <= by_distance { by_stretch } else { by_distance },
            tear_multiplier: force * (self.setup.h * self.setup.h),
        }
    }

    /// Cause of the tear of a marked constraint.
    pub(crate) fn cause(&self, index: u32, mark: TearMark) -> TearCause {
        let rest_length = self.model.constraints[index as usize].rest_length;
        let TearLengths { by_stretch, by_distance } =
            TearLengths::new(&self.limits(index), rest_length);
        match mark {
            TearMark::Force => TearCause::Force,
            TearMark::Length if by_stretch <= by_distance => TearCause::Stretch,
            TearMark::Length => TearCause::Distance,
        }
    }

    /// A rest length that equals the distance at load is paired with the square from before the
    /// root was rounded, so that the error at load is 0 to the last bit.
    fn rest(&self, constraint: Constraint) -> RestLength<f32> {
        let square = self.model.distance_squared(constraint.a, constraint.b);
        let length = constraint.rest_length;
        if square.sqrt() == length {
            RestLength { length, square }
        } else {
            RestLength::new(length)
        }
    }

    fn softness(&self, constraint: Constraint) -> PassSoftness {
        let softness = self.softness[constraint.kind as usize].unwrap_or(constraint.compliance);
        let relaxation = self.relaxation;
        match self.setup.method {
            Method::Xpbd => PassSoftness {
                scaled_compliance: softness / (self.setup.h * self.setup.h),
                share: relaxation,
            },
            Method::Pbd => PassSoftness {
                scaled_compliance: 0.0,
                share: relaxation * self.share(constraint.kind, softness),
            },
        }
    }

    fn share(&self, kind: ConstraintKind, stiffness: f32) -> f32 {
        let last_share = &self.last_shares[kind as usize];
        let (last, share) = last_share.get();
        if stiffness.to_bits() == last.to_bits() {
            return share;
        }
        let share = stiffness_per_pass(stiffness, self.iterations);
        last_share.set((stiffness, share));
        share
    }

    fn limits(&self, constraint: u32) -> Limits {
        let index = self.model.limits_index(constraint);
        match self.last_limits.get() {
            Some((last, limits)) if last == index => limits,
            _ => {
                let limits = self.merged_limits(self.model.all_limits()[index as usize]);
                self.last_limits.set(Some((index, limits)));
                limits
            }
        }
    }

    /// Limits of a constraint, with those of the scene where it has none of its own.
    fn merged_limits(&self, own: Limits) -> Limits {
        own.or(self.parameters.limits())
    }

    /// The fields of limits that any constraint may use.
    pub(crate) fn possible_limit_fields(&self) -> ConstraintFields {
        let mut fields = ConstraintFields::default();
        for own in self.model.all_limits() {
            let limits = self.merged_limits(*own);
            fields.max_lengths |= limits.max_stretch.is_some();
            fields.tear_lengths |= limits.tear_stretch.or(limits.tear_distance).is_some();
            fields.tear_multipliers |= limits.tear_force.is_some();
        }
        fields
    }
}

/// Lengths above which a constraint tears; infinite for never.
struct TearLengths {
    by_stretch: f32,
    by_distance: f32,
}

impl TearLengths {
    fn new(limits: &Limits, rest_length: f32) -> Self {
        let by_distance =
            limits.tear_distance.map_or(f32::INFINITY, |distance| rest_length + distance);
        Self { by_stretch: ratio_length(limits.tear_stretch, rest_length), by_distance }
    }
}

/// Infinite for constraints of rest length 0, to which no ratio applies.
fn ratio_length(ratio: Option<f32>, rest_length: f32) -> f32 {
    match ratio {
        Some(ratio) if rest_length > 0.0 => ratio * rest_length,
        _ => f32::INFINITY,
    }
}

/// k' = 1 - (1 - k)^(1/n): n passes with k' leave the same error as one pass with k (Position Based
/// Dynamics, Mueller et al. 2007, section 3.3).
///
/// Takes the root by bisection on repeated products: the result enters the step, and powf differs
/// between machines.
fn stiffness_per_pass(stiffness: f32, iterations: u32) -> f32 {
    let rest = 1.0 - f64::from(stiffness);
    if rest <= 0.0 || iterations == 1 {
        return stiffness;
    }
    let power = |base: f64| (0..iterations).fold(1.0, |product, _| product * base);
    let (mut low, mut high) = (0.0, 1.0);
    // 64 halvings reach adjacent f64 numbers.
    for _ in 0..64 {
        let middle: f64 = 0.5 * (low + high);
        if power(middle) < rest { low = middle } else { high = middle }
    }
    to_f32(1.0 - high)
}

#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the solver's f32")]
fn to_f32(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    //! The stiffness of a pass against its closed form.
    use super::*;

    #[test]
    fn eight_passes_have_the_published_stiffnesses_of_a_spring_cloth() {
        for (stiffness, expected) in [(0.9, 0.250_106), (0.6, 0.108_220), (0.3, 0.043_605)] {
            assert!((stiffness_per_pass(stiffness, 8) - expected).abs() < 1e-6, "{stiffness}");
        }
    }

    #[test]
    fn stiffness_per_pass_agrees_with_the_closed_form() {
        for stiffness in [0.0_f32, 0.01, 0.3, 0.6, 0.9, 0.999, 1.0] {
            for iterations in [1_u32, 2, 8, 64, 1000] {
                let expected = 1.0 - (1.0 - f64::from(stiffness)).powf(1.0 / f64::from(iterations));
                let actual = f64::from(stiffness_per_pass(stiffness, iterations));
                assert!((actual - expected).abs() < 1e-7, "{stiffness} {iterations}: {actual}");
            }
        }
    }
}
