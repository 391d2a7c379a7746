//! The messages of the service `commands`: [`Action`]s in a fixed layout.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use sim_types::Action;

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
    pub(crate) fn as_sent(self) -> Self {
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
