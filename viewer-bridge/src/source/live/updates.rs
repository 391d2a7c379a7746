//! The messages that take effect before their state: a paused node answers commands as well.

use sim_contract::{NodeStatus, Outcome, ParameterValues, Update};

/// Messages since the last read.
#[derive(Debug, Default)]
pub(super) struct Updates {
    pub(super) outcomes: Vec<Outcome>,
    /// The newest parameters.
    pub(super) parameters: Option<ParameterValues>,
    /// The newest status.
    pub(super) status: Option<NodeStatus>,
    /// Run of the newest load or status.
    pub(super) run_id: Option<u64>,
}

impl Updates {
    pub(super) fn add(&mut self, update: &Update<'_>) {
        match *update {
            Update::Topology(header, _) => self.run_id = Some(header.run_id),
            Update::Parameters(_, values) => self.parameters = Some(*values),
            Update::Outcome(outcome) => self.outcomes.push(*outcome),
            Update::Status(status) => {
                self.run_id = Some(status.run_id);
                self.status = Some(*status);
            }
            // The tap returns these with their state.
            Update::Scene(..)
            | Update::Surface(..)
            | Update::Colliders(..)
            | Update::Tears(..)
            | Update::Keyframe(..) => {}
        }
    }
}
