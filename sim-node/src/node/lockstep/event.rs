//! The changes of the members.

use std::time::Duration;

use sim_contract::{MemberChange, MemberChangeKind};

/// A change of the members. The member takes part in every `every`-th step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::node) enum Event {
    Joined {
        client_id: u64,
        every: u64,
    },
    /// It closed its connection.
    Left {
        client_id: u64,
        every: u64,
    },
    /// Its process ended without closing the connection.
    Killed {
        client_id: u64,
        every: u64,
    },
    /// It was not ready in time.
    TimedOut {
        client_id: u64,
        every: u64,
        timeout: Duration,
    },
}

impl Event {
    /// Returns the line for people. `step` is the last one that was computed.
    pub(in crate::node) fn describe(self, step: u64) -> String {
        match self {
            Self::Joined { client_id, every: 1 } => {
                format!("client {client_id} joined the lockstep at step {step}")
            }
            Self::Joined { client_id, every } => format!(
                "client {client_id} joined the lockstep at step {step}, for every {every} steps"
            ),
            Self::Left { client_id, .. } => {
                format!("client {client_id} left the lockstep at step {step}")
            }
            Self::Killed { client_id, .. } => {
                format!("client {client_id} left the lockstep at step {step}: its process ended")
            }
            Self::TimedOut { client_id, timeout, .. } => format!(
                "client {client_id} was not ready for the step after {step} within {timeout:?}: the \
                 lockstep continues without it, until it is ready for a step again"
            ),
        }
    }

    /// Returns the entry of the status. `step` is the last one that was computed.
    pub(in crate::node) fn to_change(self, step: u64) -> MemberChange {
        let (client_id, every, kind) = match self {
            Self::Joined { client_id, every } => (client_id, every, MemberChangeKind::Joined),
            Self::Left { client_id, every } => (client_id, every, MemberChangeKind::Left),
            Self::Killed { client_id, every } => (client_id, every, MemberChangeKind::Killed),
            Self::TimedOut { client_id, every, .. } => {
                (client_id, every, MemberChangeKind::TimedOut)
            }
        };
        let every = u32::try_from(every).unwrap_or(u32::MAX);
        MemberChange { client_id, step, every, kind: kind as u32 }
    }
}
