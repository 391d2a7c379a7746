//! Reasons for which a command is not applied.

use std::borrow::Cow;

use serde::{Serialize, Serializer};
use sim_contract::Reason;

use crate::limits::GRABS_PER_CLIENT_MAX;

/// The reason for which a command was not applied: the node's, or the bridge's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The node gave a reason.
    Node(Reason),
    /// The node gave a reason that this version does not know.
    Unknown,
    /// No node runs.
    NoNode,
    /// The node did not answer in time.
    NoAnswer,
    /// Too many commands wait.
    Busy,
    /// The page showed another load.
    StaleEpoch,
    /// The client grabs too many particles.
    TooManyGrabs,
    /// Only a live node accepts the command.
    OnlyLive,
    /// Only a recording accepts the command.
    OnlyReplay,
}

impl From<Reason> for Refusal {
    fn from(reason: Reason) -> Self {
        Self::Node(reason)
    }
}

impl Refusal {
    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Node(reason) => reason.name(),
            Self::Unknown => "unknown",
            Self::NoNode => "no_node",
            Self::NoAnswer => "no_answer",
            Self::Busy => "busy",
            Self::StaleEpoch => "stale_epoch",
            Self::TooManyGrabs => "too_many_grabs",
            Self::OnlyLive => "only_live",
            Self::OnlyReplay => "only_replay",
        }
    }

    /// Sentence for the user.
    pub fn text(self) -> Cow<'static, str> {
        let text = match self {
            Self::Node(Reason::NoEffectHere) => {
                "the command has no effect here: the particle is frozen, the parameter belongs to \
                 the other method, the simulation is running, the scene needs too much memory, or a \
                 recording is playing"
            }
            Self::Node(reason) => return reason.to_string().into(),
            Self::Unknown => "the node gave an unknown reason",
            Self::NoNode => "no node is running",
            Self::NoAnswer => "the node did not answer; the command may still take effect",
            Self::Busy => "too many commands are waiting; try again",
            Self::StaleEpoch => "another scene was loaded in the meantime",
            Self::TooManyGrabs => {
                return format!("you have already grabbed {GRABS_PER_CLIENT_MAX} particles").into();
            }
            Self::OnlyLive => "a recording cannot be changed",
            Self::OnlyReplay => "only a recording can do this",
        };
        text.into()
    }
}

impl Serialize for Refusal {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}
