//! What became of a command: acknowledgement and replay log in one.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::messages::command::Command;
use sim_types::Reason;

/// Outcome of a command: 296 bytes, alignment 8. Written by the owner of the name for every
/// command that it takes, in the order of application, which a re-simulation follows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Outcome")]
pub struct Outcome {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
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

const _: () = assert!(size_of::<Outcome>() == 296 && align_of::<Outcome>() == 8);

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

impl Outcome {
    /// Outcome of `command`, of no run yet: `Ok` is applied, `Err` rejected. `index` and `step` as in
    /// the fields of that name.
    pub fn new(index: u64, step: u64, command: Command, result: Result<(), Reason>) -> Self {
        let (status, reason) = match result {
            Ok(()) => (OutcomeStatus::Applied, 0),
            Err(reason) => (OutcomeStatus::Rejected, reason as u32),
        };
        Self { index, step, status: status as u32, reason, command, ..Self::default() }
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
