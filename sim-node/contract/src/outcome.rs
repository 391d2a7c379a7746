//! What became of a command: acknowledgement and replay log in one.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::Command;

/// What became of a command: 288 bytes, alignment 8. Written by the owner of the name for every
/// command that it takes, in the order of application, which a re-simulation follows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Outcome")]
pub struct Outcome {
    /// Place in the run's log, from 0, without gaps.
    pub index: u64,
    /// The first step that shows the effect.
    pub step: u64,
    /// An [`OutcomeStatus`] as a number.
    pub status: u32,
    /// A [`Reason`] as a number; 0 if applied.
    pub reason: u32,
    /// [`OUTCOME_FLAG_CONTROL`] or 0.
    pub flags: u32,
    /// Always 0.
    pub spare: u32,
    /// The command as it was sent.
    pub command: Command,
}

const _: () = assert!(size_of::<Outcome>() == 288 && align_of::<Outcome>() == 8);

/// Bit of [`Outcome::flags`]: answers a command to a replay (pause, step, ...); it is not part of
/// the replayed run's log, and its index is the number of outcomes replayed so far.
pub const OUTCOME_FLAG_CONTROL: u32 = 1;

/// Whether a command took effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum OutcomeStatus {
    /// It did, in the step that the outcome names.
    Applied = 0,
    /// It did not, and changed no bit of the state.
    Rejected = 1,
}

/// Why a command was rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Reason {
    /// A number is NaN or infinite.
    NonFinite = 1,
    /// A coordinate beyond 1e7, or a parameter outside of its range.
    OutOfRange = 2,
    /// The scene has no such particle.
    UnknownParticle = 3,
    /// The scene has no such constraint.
    UnknownConstraint = 4,
    /// The scene has no such anchor.
    UnknownAnchor = 5,
    /// The scene has no such collider.
    UnknownCollider = 6,
    /// There is no such parameter.
    UnknownParameter = 7,
    /// The constraint is torn already.
    AlreadyTorn = 8,
    /// The particle is not grabbed.
    NotGrabbed = 9,
    /// Another client holds the particle.
    GrabbedByOther = 10,
    /// The command means nothing here: a kind of another version, `step` while running, or a
    /// change of a recording that is being played.
    NoEffectHere = 11,
}

const REASONS: [(Reason, &str); 11] = [
    (Reason::NonFinite, "non_finite"),
    (Reason::OutOfRange, "out_of_range"),
    (Reason::UnknownParticle, "unknown_particle"),
    (Reason::UnknownConstraint, "unknown_constraint"),
    (Reason::UnknownAnchor, "unknown_anchor"),
    (Reason::UnknownCollider, "unknown_collider"),
    (Reason::UnknownParameter, "unknown_parameter"),
    (Reason::AlreadyTorn, "already_torn"),
    (Reason::NotGrabbed, "not_grabbed"),
    (Reason::GrabbedByOther, "grabbed_by_other"),
    (Reason::NoEffectHere, "no_effect_here"),
];

impl Reason {
    /// Its word in logs.
    pub fn name(self) -> &'static str {
        REASONS.iter().find(|(reason, _)| *reason == self).map_or("", |(_, name)| name)
    }

    /// The reason with that word.
    pub fn from_name(name: &str) -> Option<Self> {
        REASONS.iter().find(|(_, known)| *known == name).map(|(reason, _)| *reason)
    }

    /// The reason with that number.
    pub fn from_number(number: u32) -> Option<Self> {
        REASONS.iter().find(|(reason, _)| *reason as u32 == number).map(|(reason, _)| *reason)
    }
}

impl Outcome {
    /// The outcome of `command`: `Ok` is applied, `Err` rejected. `index` and `step` as in the
    /// fields of that name.
    pub fn new(index: u64, step: u64, command: Command, result: Result<(), Reason>) -> Self {
        let (status, reason) = match result {
            Ok(()) => (OutcomeStatus::Applied, 0),
            Err(reason) => (OutcomeStatus::Rejected, reason as u32),
        };
        Self { index, step, status: status as u32, reason, flags: 0, spare: 0, command }
    }

    /// Whether the command took effect.
    pub fn is_applied(&self) -> bool {
        self.status == OutcomeStatus::Applied as u32
    }

    /// Why it was rejected, as a word; "" if it was applied, "unknown" for a number of another
    /// version.
    pub fn reason_name(&self) -> &'static str {
        match Reason::from_number(self.reason) {
            Some(reason) => reason.name(),
            None if self.reason == 0 => "",
            None => "unknown",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_has_one_name_and_one_number() {
        for (reason, name) in REASONS {
            assert_eq!(Reason::from_name(name), Some(reason));
            assert_eq!(Reason::from_number(reason as u32), Some(reason));
        }
        assert_eq!(Reason::from_number(0), None);
    }
}
