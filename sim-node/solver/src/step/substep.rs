//! One substep of a step, and its inputs.

use super::prediction::Prediction;
use crate::contacts::obstacle::Obstacle;

/// A substep of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Substep {
    /// From 0.
    pub(crate) index: u32,
    /// Number of substeps in the step.
    pub(crate) count: u32,
}

impl Substep {
    /// Substeps of a step, in order.
    pub(crate) fn all(count: u32) -> impl Iterator<Item = Self> {
        (0..count).map(move |index| Self { index, count })
    }

    pub(crate) fn is_first(self) -> bool {
        self.index == 0
    }

    /// Number of substeps left in this step, this one included.
    pub(crate) fn left(self) -> u32 {
        self.count - self.index
    }
}

/// Inputs of the swept stages, the same for every particle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SubstepInputs<'a> {
    pub(crate) prediction: Prediction,
    /// In the order of contact.
    pub(crate) obstacles: &'a [Obstacle],
}
