//! The messages of the service `outcomes`: acknowledgement and replay log in one.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::messages::command::Command;
use sim_types::Reason;

/// Outcome of a command: 296 bytes, alignment 8. The owner of the name writes one for every command
/// that it receives, and for every grab that ends with its connection, in the order of application. Re-simulation follows that order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Outcome")]
pub struct Outcome {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Position in the run's log, from 0, without gaps.
    pub index: u64,
    /// First step that shows the effect. A node that is asked to stop may give up this step.
    pub step: u64,
    /// An [`OutcomeStatus`] as a number.
    pub status: u32,
    /// A [`Reason`] as a number; 0 if applied.
    pub reason: u32,
    /// [`OUTCOME_FLAG_CONTROL`], [`OUTCOME_FLAG_DISCONNECTED`] or [`OUTCOME_FLAG_NEW_RUN`], else 0.
    pub flags: u32,
    /// Always 0.
    pub spare: u32,
    /// The command as it was sent.
    pub command: Command,
}

const _: () = assert!(size_of::<Outcome>() == 296 && align_of::<Outcome>() == 8);

/// Bit of [`Outcome::flags`]: the outcome answers a command that controls a replay (pause, step,
/// ...). It is not part of the replayed run's log; its index is the number of outcomes replayed so
/// far.
pub const OUTCOME_FLAG_CONTROL: u32 = 1;

/// Bit of [`Outcome::flags`]: the outcome answers no command. The owner released a particle, because
/// the connection through which a client grabbed it has ended. The command is a release by that
/// client, with sequence 0.
pub const OUTCOME_FLAG_DISCONNECTED: u32 = 1 << 1;

/// Bit of [`Outcome::flags`]: the outcome answers a load of a scene with another rate. It is the last one
/// of its run, and `step` is never made. The scene begins a new run at step 0.
pub const OUTCOME_FLAG_NEW_RUN: u32 = 1 << 2;

/// Effect of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum OutcomeStatus {
    /// It took effect, in the step that the outcome names.
    Applied = 0,
    /// It changed no bit of the state.
    Rejected = 1,
}

impl Outcome {
    /// Creates the outcome of a command: `Ok` is applied, `Err` rejected. `run_id` is 0; the owner
    /// sets it.
    pub fn new(index: u64, step: u64, command: Command, result: Result<(), Reason>) -> Self {
        let (status, reason) = match result {
            Ok(()) => (OutcomeStatus::Applied, 0),
            Err(reason) => (OutcomeStatus::Rejected, reason as u32),
        };
        Self { index, step, status: status as u32, reason, command, ..Self::default() }
    }

    /// Returns `true` if the command took effect.
    pub fn is_applied(&self) -> bool {
        self.status == OutcomeStatus::Applied as u32
    }

    /// Returns `true` if a replay has answered; see [`OUTCOME_FLAG_CONTROL`].
    pub fn is_of_replay(&self) -> bool {
        self.flags & OUTCOME_FLAG_CONTROL != 0
    }

    /// Returns `true` if the owner released a particle of a client that is gone; see
    /// [`OUTCOME_FLAG_DISCONNECTED`].
    pub fn is_disconnection(&self) -> bool {
        self.flags & OUTCOME_FLAG_DISCONNECTED != 0
    }

    /// Returns `true` if the command has begun a new run; see [`OUTCOME_FLAG_NEW_RUN`].
    pub fn begins_run(&self) -> bool {
        self.flags & OUTCOME_FLAG_NEW_RUN != 0
    }

    /// Returns the reason for the rejection; `None` if the command was applied, or for a number that
    /// this version does not know.
    pub fn reason(&self) -> Option<Reason> {
        Reason::from_number(self.reason)
    }

    /// Name of the [`Reason`]: "" if the command was applied, "unknown" for a number that this version
    /// does not know.
    pub fn reason_name(&self) -> &'static str {
        match self.reason() {
            Some(reason) => reason.name(),
            None if self.reason == 0 => "",
            None => "unknown",
        }
    }
}
