//! Distance constraints, stored in the order in which they are projected.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::order::Order;
use crate::scene::{Method, Model, SolverSettings};

/// What a constraint is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum ConstraintKind {
    /// Between direct neighbours.
    #[default]
    Structural = 0,
    /// Across a diagonal.
    Shear = 1,
    /// Between next neighbours but one.
    Bend = 2,
    /// Acts only when longer than its rest length.
    Tether = 3,
}

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

/// All constraints in projection order: one array per field, each `constraint_count` long.
/// No two constraints of one group share a particle, except in the serial last one.
#[derive(Debug, Clone)]
pub(crate) struct Constraints {
    /// The two particles.
    pub(crate) pairs: Vec<[u32; 2]>,
    pub(crate) rest_lengths: Vec<f32>,
    /// xpbd: compliance / h^2, in 1/kg. pbd: the share k' of the error that one pass takes away.
    pub(crate) softness: Vec<f32>,
    /// Whether it acts only when longer than its rest length.
    pub(crate) pull_only: Vec<bool>,
    /// The multipliers of the running substep, in kg m (xpbd).
    pub(crate) multipliers: Vec<f32>,
    /// Ranges of the arrays above, in the order of projection.
    pub(crate) groups: Vec<Range<usize>>,
}

impl Constraints {
    pub(crate) fn new(model: &Model, order: &Order, settings: &SolverSettings) -> Self {
        let in_order = || order.indices.iter().map(|index| model.constraints[*index as usize]);
        let softness = |one: Constraint| match settings.method {
            Method::Xpbd => one.compliance / (settings.h() * settings.h()),
            Method::Pbd => stiffness_per_pass(one.compliance, settings.iterations),
        };
        Self {
            pairs: in_order().map(|one| [one.a, one.b]).collect(),
            rest_lengths: in_order().map(|one| one.rest_length).collect(),
            softness: in_order().map(softness).collect(),
            pull_only: in_order().map(|one| one.kind == ConstraintKind::Tether).collect(),
            multipliers: vec![0.0; model.constraints.len()],
            groups: order.groups.clone(),
        }
    }
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
