//! The results of a comparison, and the first field in which two states differ, bit by bit.

use std::fmt;

use serde::Serialize;
use sim_messages::ParticleState;

use crate::log::Frame;

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

/// One field of one particle in two states.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Index of the particle.
    pub particle: usize,
    /// Name of the field, such as "position x".
    pub field: &'static str,
    /// The value in the recording, with its bits.
    pub recorded: String,
    /// The re-simulated value, with its bits.
    pub simulated: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { particle, field, recorded, simulated } = self;
        write!(
            formatter,
            "particle {particle}, {field}: recorded {recorded}, simulated {simulated}"
        )
    }
}

/// The 32-bit words of a particle, in order.
const FIELDS: [&str; 8] = [
    "position x",
    "position y",
    "position z",
    "inverse_mass",
    "velocity x",
    "velocity y",
    "velocity z",
    "flags",
];

/// Returns the first field that differs, or `None` if all bits are equal. Both slices have the same
/// length.
pub fn first_difference(
    recorded: &[ParticleState],
    simulated: &[ParticleState],
) -> Option<Difference> {
    recorded.iter().zip(simulated).enumerate().find_map(|(particle, (old, new))| {
        let old: [u32; 8] = bytemuck::cast(*old);
        let new: [u32; 8] = bytemuck::cast(*new);
        let place = (0..FIELDS.len()).find(|place| old[*place] != new[*place])?;
        let field = FIELDS[place];
        let [recorded, simulated] = [old[place], new[place]].map(|bits| value(field, bits));
        Some(Difference { particle, field, recorded, simulated })
    })
}

/// The first difference of two snapshots of a step.
#[derive(Debug, Clone, PartialEq)]
pub enum SnapshotDifference {
    /// A field of a particle.
    Particle(Difference),
    /// All particles are equal, but not the hash, which includes the torn constraints.
    TornConstraints,
}

/// Returns the first difference of two snapshots of a step, compared bit by bit. Both have the same number of
/// particles.
pub fn snapshot_difference(a: &Frame, b: &Frame) -> Option<SnapshotDifference> {
    if let Some(found) = first_difference(a.payload(), b.payload()) {
        return Some(SnapshotDifference::Particle(found));
    }
    (a.row.state_hash != b.row.state_hash).then_some(SnapshotDifference::TornConstraints)
}

/// Returns the distance between the positions of a particle in two states, in m. It is computed in f64, so that the
/// difference of near positions is exact.
pub fn distance(a: &ParticleState, b: &ParticleState) -> f64 {
    let squares = a.position.iter().zip(b.position).map(|(a, b)| {
        let difference = f64::from(*a) - f64::from(b);
        difference * difference
    });
    squares.sum::<f64>().sqrt()
}

fn value(field: &str, bits: u32) -> String {
    if field == "flags" {
        format!("{bits:#x}")
    } else {
        format!("{} ({bits:#010x})", f32::from_bits(bits))
    }
}

#[cfg(test)]
mod difference_tests {
    use super::*;

    #[test]
    fn the_difference_names_the_first_field_with_a_different_bit() {
        let zero = ParticleState::default();
        let other = ParticleState { velocity: [0.0, -0.0, 0.0], flags: 1, ..zero };
        assert_eq!(first_difference(&[zero, zero], &[zero, zero]), None);
        let difference = first_difference(&[zero, zero], &[zero, other]).unwrap();
        assert_eq!(
            difference.to_string(),
            "particle 1, velocity y: recorded 0 (0x00000000), simulated -0 (0x80000000)"
        );
    }

    #[test]
    fn nans_with_equal_bits_are_equal() {
        let nan = ParticleState { inverse_mass: f32::NAN, ..ParticleState::default() };
        assert_eq!(first_difference(&[nan], &[nan]), None);
    }
}
