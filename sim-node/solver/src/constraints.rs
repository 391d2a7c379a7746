//! Distance constraints: what a scene says of them, and what follows from the parameters.

use std::cell::Cell;

use sim_types::{ConstraintKind, Method, TearCause};

use crate::bodies::{Give, Term};
use crate::parameters::Parameters;
use crate::project::Rest;
use crate::scene::{Limits, Model};

/// One constraint as the scene gives it. Its index is its place in the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constraint {
    /// Index of the first particle.
    pub a: u32,
    /// Index of the second particle.
    pub b: u32,
    /// Rest length in the scene's unit, >= 0.
    pub rest_length: f32,
    /// Compliance in m/N (xpbd), or stiffness 0..=1 (pbd).
    pub compliance: f32,
    /// What it is for.
    pub kind: ConstraintKind,
}

/// Works out what constraints are like.
pub(crate) struct Recipe<'a> {
    pub(crate) model: &'a Model,
    pub(crate) parameters: &'a Parameters,
    pub(crate) setup: Setup,
    /// The last stiffness, and its share of a pass: the root is dear, and most constraints have
    /// the stiffness of the one before.
    last_share: Cell<(f32, f32)>,
}

impl<'a> Recipe<'a> {
    pub(crate) fn new(model: &'a Model, parameters: &'a Parameters, setup: Setup) -> Self {
        Self { model, parameters, setup, last_share: Cell::new((f32::NAN, f32::NAN)) }
    }

    /// Where the rest length is the distance at load, its square is that of the distance before
    /// its root was rounded: at load, the error is 0 to the last bit.
    fn rest(&self, constraint: Constraint) -> Rest<f32> {
        let square = self.model.distance_squared(constraint.a, constraint.b);
        let length = constraint.rest_length;
        if square.sqrt() == length { Rest { length, square } } else { Rest::new(length) }
    }

    fn give(&self, constraint: Constraint) -> Give {
        let softness = self.parameters.softness(constraint.kind, constraint.compliance);
        let relaxation = self.parameters.relaxation;
        match self.setup.method {
            Method::Xpbd => {
                Give { softness: softness / (self.setup.h * self.setup.h), share: relaxation }
            }
            Method::Pbd => Give { softness: 0.0, share: relaxation * self.share(softness) },
        }
    }

    fn share(&self, stiffness: f32) -> f32 {
        let (last, share) = self.last_share.get();
        if stiffness.to_bits() == last.to_bits() {
            return share;
        }
        let share = stiffness_per_pass(stiffness, self.parameters.iterations);
        self.last_share.set((stiffness, share));
        share
    }

    fn limits(&self, index: u32) -> Limits {
        self.model.limits(index).or(self.parameters.limits())
    }

    /// The lengths above which a constraint tears: by its stretch, and by its distance.
    fn tear_lengths(&self, index: u32) -> (f32, f32) {
        let rest_length = self.model.constraints[index as usize].rest_length;
        let limits = self.limits(index);
        (
            ratio_length(limits.tear_stretch, rest_length),
            distance_length(limits.tear_distance, rest_length),
        )
    }

    /// Why a constraint that is too long tears.
    pub(crate) fn length_cause(&self, index: u32) -> TearCause {
        let (by_stretch, by_distance) = self.tear_lengths(index);
        if by_stretch <= by_distance { TearCause::Stretch } else { TearCause::Distance }
    }
}

impl Recipe<'_> {
    /// What a constraint is like that is whole.
    pub(crate) fn term(&self, index: u32) -> Term {
        let one = self.model.constraints[index as usize];
        let limits = self.limits(index);
        let (by_stretch, by_distance) = self.tear_lengths(index);
        let force = limits.tear_force.unwrap_or(f32::INFINITY);
        Term {
            rest: self.rest(one),
            // A length is never below -1.
            floor: if one.kind == ConstraintKind::Tether { one.rest_length } else { -1.0 },
            give: self.give(one),
            max_length: ratio_length(limits.max_stretch, one.rest_length),
            tear_length: if by_stretch <= by_distance { by_stretch } else { by_distance },
            tear_multiplier: force * (self.setup.h * self.setup.h),
        }
    }

    /// Passes of a substep.
    pub(crate) fn pass_count(&self) -> u32 {
        self.parameters.iterations
    }
}

/// What does not change while a scene runs, or follows from the rate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Setup {
    pub(crate) method: Method,
    /// Length of a substep in seconds.
    pub(crate) h: f32,
}

/// A ratio says nothing of a constraint without length.
fn ratio_length(ratio: Option<f32>, rest_length: f32) -> f32 {
    match ratio {
        Some(ratio) if rest_length > 0.0 => ratio * rest_length,
        _ => f32::INFINITY,
    }
}

fn distance_length(distance: Option<f32>, rest_length: f32) -> f32 {
    distance.map_or(f32::INFINITY, |distance| rest_length + distance)
}

/// k' = 1 - (1 - k)^(1/n): n passes with k' leave the same error as one pass with k.
/// (Position Based Dynamics, Mueller et al. 2007, section 3.3.)
///
/// The root is taken by bisection on repeated products, because powf is not the same on every
/// machine and these bits enter the step.
fn stiffness_per_pass(stiffness: f32, iterations: u32) -> f32 {
    let rest = 1.0 - f64::from(stiffness);
    if rest <= 0.0 || iterations == 1 {
        return stiffness;
    }
    let power = |base: f64| (0..iterations).fold(1.0, |product, _| product * base);
    let (mut low, mut high) = (0.0, 1.0);
    // 64 halvings reach neighbouring f64 numbers.
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
    //! The stiffness of a pass against the closed form.
    use super::*;

    #[test]
    fn eight_passes_share_the_stiffnesses_of_a_spring_cloth() {
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
