//! One substep of a step, and its inputs.

use std::sync::atomic::{AtomicBool, Ordering};

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
    /// Fraction of each correction that is applied.
    pub(crate) relaxation: f32,
    /// In the order of contact.
    pub(crate) obstacles: &'a [Obstacle],
    /// Gives the step up when it becomes true.
    pub(crate) stop: &'a AtomicBool,
}

impl SubstepInputs<'_> {
    /// Returns true if the step is given up. Long loops read it once per row, block or obstacle: a
    /// load of a flag that nothing writes costs nothing there.
    #[inline(always)]
    pub(crate) fn is_given_up(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
