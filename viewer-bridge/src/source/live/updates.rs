//! The messages that take effect before their state: a paused node answers commands as well.

use sim_contract::{NodeStatus, Outcome, ParameterValues, Update};

/// Messages since the last read.
#[derive(Debug, Default)]
pub(super) struct Updates {
    /// The run of the link; `None` before its first message.
    known_run: Option<u64>,
    /// Outcomes of every run, in order: a command can reach the run after the one it was sent to.
    pub(super) outcomes: Vec<Outcome>,
    /// The newest parameters.
    pub(super) parameters: Option<ParameterValues>,
    /// The newest status of the known run.
    pub(super) status: Option<NodeStatus>,
    /// Steps and bytes of the keyframes of the known run.
    pub(super) keyframes: Vec<(u64, Vec<u8>)>,
    /// Run of the newest load or status.
    pub(super) run_id: Option<u64>,
}

impl Updates {
    pub(super) fn for_run(known_run: Option<u64>) -> Self {
        Self { known_run, ..Self::default() }
    }

    pub(super) fn add(&mut self, update: &Update<'_>) {
        match *update {
            Update::Topology(header, _) => self.run_id = Some(header.run_id),
            Update::Parameters(_, values) => self.parameters = Some(values.clone()),
            Update::Outcome(outcome) => self.outcomes.push(*outcome),
            Update::Status(status) => {
                self.run_id = Some(status.run_id);
                if self.known_run.is_none_or(|known| known == status.run_id) {
                    self.status = Some(*status);
                }
            }
            Update::Keyframe(header, bytes) => {
                if self.known_run.is_none_or(|known| known == header.run_id) {
                    self.keyframes.push((header.step, bytes.to_vec()));
                }
            }
            // The tap returns these with their state.
            Update::Scene(..)
            | Update::Bends(..)
            | Update::Surface(..)
            | Update::Colliders(..)
            | Update::Tears(..)
            | Update::Forces(..) => {}
        }
    }
}
