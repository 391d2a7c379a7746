//! The results of a comparison.

use anyhow::bail;
use serde::Serialize;

use super::difference::Difference;

/// The result of the comparison of one snapshot. The texts are for people.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// Every bit is equal.
    Identical,
    /// Content that belongs to no step differs.
    OtherContent { what: String },
    /// A signal ended the simulation before the snapshot.
    Interrupted,
    /// The simulation differs from the recording.
    Diverged {
        /// The first step that differs.
        step: u64,
        what: String,
        difference: Option<Difference>,
    },
    /// Outcomes are missing, so this state and the next ones cannot be simulated. The simulation goes on from
    /// the next complete state.
    Incomplete {
        /// The first step that may lack an outcome.
        step: u64,
        what: String,
    },
    /// The state follows missing outcomes, or is the complete one from which the simulation goes on.
    NotCompared,
}

/// Steps whose states could not be simulated, because outcomes are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct StepGap {
    /// The first step that may lack an outcome.
    pub(crate) from: u64,
    /// The step of the complete state from which the simulation went on, or of the last state.
    pub(crate) to: u64,
}

impl Finding {
    /// Returns the finding for content that belongs to no step.
    pub(crate) fn in_file(what: String) -> Self {
        Self::OtherContent { what }
    }

    /// Returns an error for a difference, and after a signal.
    pub(crate) fn require_identical(self) -> anyhow::Result<()> {
        match self {
            Self::Identical => Ok(()),
            Self::Interrupted => bail!("interrupted"),
            Self::Diverged { step, what, .. } | Self::Incomplete { step, what } => {
                bail!(
                    "step {step} cannot be simulated: {what} (`recorder verify` shows the details)"
                )
            }
            Self::OtherContent { what } => bail!("{what}"),
            Self::NotCompared => bail!("outcomes are missing"),
        }
    }

    /// Returns the finding for content of a step.
    pub(super) fn at_step(step: u64, what: String) -> Self {
        Self::Diverged { step, what, difference: None }
    }
}
