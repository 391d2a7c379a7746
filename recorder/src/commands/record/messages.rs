//! The messages that are recorded as they arrive, without waiting for their state.

use sim_contract::{KeyframeHeader, NodeStatus, OUTCOME_FLAG_CONTROL, Outcome, Update};

/// Copies of the messages that a tap passes on between two states. A paused node publishes outcomes
/// long before the state that contains their effect.
#[derive(Debug, Default)]
pub(crate) struct Messages {
    pub(crate) keyframes: Vec<(KeyframeHeader, Vec<u8>)>,
    pub(crate) outcomes: Vec<Outcome>,
    pub(crate) statuses: Vec<NodeStatus>,
}

impl Messages {
    /// Copies a message of these services. Skips the answers of a replay to its controls, which are
    /// not part of the recorded run.
    pub(crate) fn add(&mut self, update: &Update<'_>) {
        match *update {
            Update::Keyframe(header, bytes) => self.keyframes.push((*header, bytes.to_vec())),
            Update::Outcome(outcome) if outcome.flags & OUTCOME_FLAG_CONTROL == 0 => {
                self.outcomes.push(*outcome);
            }
            Update::Status(status) => self.statuses.push(*status),
            _ => {}
        }
    }
}
