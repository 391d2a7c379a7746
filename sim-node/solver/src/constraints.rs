//! Distance constraints, stored in the order in which they are projected.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::order::Order;
use crate::parameters::Parameters;
use crate::scene::{Method, Model};
use crate::tear::TearCause;

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

impl ConstraintKind {
    /// The kind of that number, if there is one.
    pub fn from_number(number: u32) -> Option<Self> {
        [Self::Structural, Self::Shear, Self::Bend, Self::Tether].get(number as usize).copied()
    }
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

/// The length that a constraint goes back to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rest {
    pub(crate) length: f32,
    /// Its square. Where the length is the distance at load, this is the square of that distance
    /// before its root was rounded: at load, the error is 0 to the last bit.
    pub(crate) square: f32,
}

impl Rest {
    pub(crate) fn new(length: f32) -> Self {
        Self { length, square: length * length }
    }
}

fn rest_at_load(model: &Model, constraint: Constraint) -> Rest {
    let square = model.distance_squared(constraint.a, constraint.b);
    let length = constraint.rest_length;
    if square.sqrt() == length { Rest { length, square } } else { Rest::new(length) }
}

/// All constraints in projection order: one array per field, each `constraint_count` long.
///
/// A torn constraint is a tether of infinite length: it never pulls, and no kernel needs to know
/// of it.
#[derive(Debug, Clone)]
pub(crate) struct Constraints {
    /// The two particles.
    pub(crate) pairs: Vec<[u32; 2]>,
    /// Of infinite length where torn.
    pub(crate) rests: Vec<Rest>,
    /// xpbd: compliance / h^2, in 1/kg. pbd: the share of the error that one pass takes away,
    /// w k', w being the relaxation factor.
    pub(crate) softness: Vec<f32>,
    /// Whether it acts only when longer than its rest length.
    pub(crate) pull_only: Vec<bool>,
    /// The multipliers of the running substep, in kg m.
    pub(crate) multipliers: Vec<f32>,
    /// Ranges of the arrays above, in the order of projection.
    pub(crate) groups: Vec<Range<usize>>,
    /// Groups at the beginning in which no two constraints share a particle.
    pub(crate) independent_count: usize,
    /// Lengths that none exceeds; no entries where nothing is limited.
    pub(crate) max_lengths: Vec<f32>,
    /// Lengths above which they tear; no entries where none tears by its length.
    pub(crate) tear_lengths: Vec<f32>,
    /// Which limit `tear_lengths` holds.
    pub(crate) tear_causes: Vec<TearCause>,
    /// Multipliers above which they tear, force times h^2; no entries where none tears by force.
    pub(crate) tear_multipliers: Vec<f32>,
    /// Slot by slot: the index in the scene.
    pub(crate) indices: Vec<u32>,
    /// Index by index: the slot in these arrays.
    slots: Vec<u32>,
}

impl Constraints {
    pub(crate) fn new(model: &Model, order: &Order) -> Self {
        let in_order = || order.indices.iter().map(|index| model.constraints[*index as usize]);
        let mut slots = vec![0; order.indices.len()];
        for (slot, index) in (0_u32..).zip(&order.indices) {
            slots[*index as usize] = slot;
        }
        Self {
            pairs: in_order().map(|one| [one.a, one.b]).collect(),
            rests: in_order().map(|one| rest_at_load(model, one)).collect(),
            softness: vec![0.0; order.indices.len()],
            pull_only: in_order().map(|one| one.kind == ConstraintKind::Tether).collect(),
            multipliers: vec![0.0; order.indices.len()],
            groups: order.groups.clone(),
            independent_count: order.independent_count,
            max_lengths: Vec::new(),
            tear_lengths: Vec::new(),
            tear_causes: Vec::new(),
            tear_multipliers: Vec::new(),
            indices: order.indices.clone(),
            slots,
        }
    }

    /// Makes every torn constraint whole again.
    pub(crate) fn mend(&mut self, model: &Model) {
        for (slot, index) in self.indices.iter().enumerate() {
            let one = model.constraints[*index as usize];
            self.rests[slot] = rest_at_load(model, one);
            self.pull_only[slot] = one.kind == ConstraintKind::Tether;
        }
    }

    /// Works out everything that follows from the parameters.
    pub(crate) fn configure(&mut self, model: &Model, parameters: &Parameters, setup: Setup) {
        let h_squared = setup.h * setup.h;
        // The root is dear, and most constraints have the stiffness of the one before.
        let (mut stiffness, mut share) = (f32::NAN, f32::NAN);
        for (slot, index) in self.indices.iter().enumerate() {
            let one = model.constraints[*index as usize];
            let softness = parameters.softness(one.kind, one.compliance);
            self.softness[slot] = match setup.method {
                Method::Xpbd => softness / h_squared,
                Method::Pbd => {
                    if softness.to_bits() != stiffness.to_bits() {
                        stiffness = softness;
                        share = stiffness_per_pass(softness, parameters.iterations);
                    }
                    parameters.relaxation * share
                }
            };
        }
        let limits = parameters.limits();
        let of = |index: u32| model.limits(index).or(limits);
        let rest = |index: u32| model.constraints[index as usize].rest_length;
        self.max_lengths =
            self.thresholds(|index| ratio_length(of(index).max_stretch, rest(index)));
        let by_stretch = |index| ratio_length(of(index).tear_stretch, rest(index));
        let by_distance = |index| distance_length(of(index).tear_distance, rest(index));
        let is_stretch = |index| by_stretch(index) <= by_distance(index);
        self.tear_lengths =
            self.thresholds(
                |index| {
                    if is_stretch(index) { by_stretch(index) } else { by_distance(index) }
                },
            );
        self.tear_causes = (self.indices[..self.tear_lengths.len()].iter())
            .map(|index| if is_stretch(*index) { TearCause::Stretch } else { TearCause::Distance })
            .collect();
        self.tear_multipliers =
            self.thresholds(|index| of(index).tear_force.unwrap_or(f32::INFINITY) * h_squared);
    }

    /// A number for each slot, infinite for torn ones; none at all where all are infinite.
    fn thresholds(&self, of: impl Fn(u32) -> f32) -> Vec<f32> {
        let slots = self.indices.iter().zip(&self.rests);
        let values = slots.map(
            |(index, rest)| {
                if rest.length.is_infinite() { f32::INFINITY } else { of(*index) }
            },
        );
        let values: Vec<_> = values.collect();
        if values.iter().all(|value| value.is_infinite()) { Vec::new() } else { values }
    }

    /// The first slot behind the groups in which no two constraints share a particle.
    pub(crate) fn independent_end(&self) -> usize {
        self.groups[..self.independent_count].last().map_or(0, |group| group.end)
    }

    pub(crate) fn is_torn(&self, index: u32) -> bool {
        self.rests[self.slots[index as usize] as usize].length.is_infinite()
    }

    /// Takes a constraint out for good.
    pub(crate) fn tear(&mut self, index: u32) {
        let slot = self.slots[index as usize] as usize;
        self.rests[slot] = Rest::new(f32::INFINITY);
        self.pull_only[slot] = true;
        for limits in [&mut self.max_lengths, &mut self.tear_lengths, &mut self.tear_multipliers] {
            if let Some(limit) = limits.get_mut(slot) {
                *limit = f32::INFINITY;
            }
        }
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
