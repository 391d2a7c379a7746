//! The results of a comparison.

use serde::Serialize;

use super::difference::Difference;

/// The result of the comparison of one snapshot. The texts are for people.
#[derive(Debug, Clone, PartialEq)]
pub enum SnapshotFinding {
    /// Every bit is equal.
    Identical,
    /// Content that belongs to no step differs.
    OtherContent {
        /// Description of the difference.
        what: String,
    },
    /// A signal ended the simulation before the snapshot.
    Interrupted,
    /// The simulation differs from the recording.
    Diverged {
        /// The first step that differs.
        step: u64,
        /// Description of the difference.
        what: String,
        /// The first field that differs, if particles do.
        difference: Option<Difference>,
    },
    /// Outcomes are missing, so this state and the next ones cannot be simulated. The simulation goes on from
    /// the next complete state.
    Incomplete {
        /// The first step that may lack an outcome.
        step: u64,
        /// Description of the missing outcome.
        what: String,
    },
    /// The state follows missing outcomes, or is the complete one from which the simulation goes on.
    NotCompared,
}

/// Steps whose states were not compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct StepGap {
    /// The first step: of a gap, the first one that may lack an outcome.
    pub from: u64,
    /// The last step: of a gap, the step of the complete state from which the simulation went on, or of the last state.
    pub to: u64,
}

/// The reason why a snapshot is not the simulated one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotIdentical {
    /// A signal ended the simulation.
    #[error("interrupted")]
    Interrupted,
    /// The state of a step differs, or outcomes are missing.
    #[error("step {step} cannot be simulated: {what} (`recorder verify` shows the details)")]
    Step {
        /// The first step that differs.
        step: u64,
        /// Description of the difference.
        what: String,
    },
    /// Content that belongs to no step differs.
    #[error("{what}")]
    File {
        /// Description of the difference.
        what: String,
    },
    /// The state follows missing outcomes.
    #[error("outcomes are missing")]
    NotCompared,
}

impl SnapshotFinding {
    /// Returns the finding for content that belongs to no step.
    pub(super) fn in_file(what: String) -> Self {
        Self::OtherContent { what }
    }

    /// Returns an error for a difference, and after a signal.
    ///
    /// # Errors
    /// Every finding but [`Self::Identical`].
    pub fn require_identical(self) -> Result<(), NotIdentical> {
        match self {
            Self::Identical => Ok(()),
            Self::Interrupted => Err(NotIdentical::Interrupted),
            Self::Diverged { step, what, .. } | Self::Incomplete { step, what } => {
                Err(NotIdentical::Step { step, what })
            }
            Self::OtherContent { what } => Err(NotIdentical::File { what }),
            Self::NotCompared => Err(NotIdentical::NotCompared),
        }
    }

    /// Returns the step of the finding.
    pub(super) fn step(&self) -> Option<u64> {
        match self {
            Self::Diverged { step, .. } | Self::Incomplete { step, .. } => Some(*step),
            _ => None,
        }
    }

    /// Returns `true` if nothing after it can be compared.
    pub(super) fn ends_comparison(&self) -> bool {
        matches!(self, Self::Interrupted | Self::Diverged { .. } | Self::OtherContent { .. })
    }

    /// Returns the finding for content of a step.
    pub(super) fn at_step(step: u64, what: String) -> Self {
        Self::Diverged { step, what, difference: None }
    }
}
