//! The messages of the services `commands`, [`Action`]s in a fixed layout, and `outcomes`: acknowledgement and replay
//! log in one.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use sim_types::{Action, Reason};

/// Client id of every `sim-node ctl`, so that one call can release a particle that
/// another call grabbed.
pub const CONSOLE_CLIENT_ID: u64 = 0;

/// A command: 256 bytes, alignment 8. Written by clients, read by the owner of the name; also part
/// of an [`crate::Outcome`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Command")]
pub struct Command {
    /// Number of the kind of command.
    pub kind: u32,
    /// Always 0.
    pub spare: u32,
    /// Random number of the sender, below 2^53 (exact in JSON); [`CONSOLE_CLIENT_ID`] is the console.
    pub client_id: u64,
    /// Number of the command among those of its client, ascending, below 2^53.
    pub sequence: u64,
    /// Fields of the kind, one after the other, without gaps; then zeros.
    pub fields: [u8; 232],
}

const _: () = assert!(size_of::<Command>() == 256 && align_of::<Command>() == 8);

impl Default for Command {
    fn default() -> Self {
        Self::zeroed()
    }
}

impl Command {
    /// Encodes an action as the command `sequence` of the client `client_id`.
    pub fn new(client_id: u64, sequence: u64, action: Action) -> Self {
        Self { kind: action.number(), spare: 0, client_id, sequence, fields: action.encode() }
    }

    /// Decodes the action. A kind or fields that this version does not know become [`Action::Unknown`].
    pub fn action(&self) -> Action {
        Action::decode(self.kind, &self.fields)
    }

    /// Returns the command without the fields that the node replaces in its outcome: the step of a rewind
    /// and the hash of a restore.
    #[must_use]
    pub fn as_sent(self) -> Self {
        match self.action() {
            Action::Rewind { .. } => Self { fields: [0; Action::FIELDS_SIZE_BYTES], ..self },
            Action::Restore { contents, .. } => {
                let sent = Action::Restore { contents, state_hash: 0 };
                Self { fields: sent.encode(), ..self }
            }
            _ => self,
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_survives_the_wire_with_its_sender() {
        for action in Action::samples() {
            let command = Command::new(11, 12, action);
            assert_eq!(command.action(), action);
            assert_eq!((command.client_id, command.sequence, command.spare), (11, 12, 0));
        }
    }
}
