//! The result of a simulation.

use sim_contract::{Command, Outcome, Reason};
use sim_solver::Solver;

use crate::log::TimedCommand;

use super::job::Start;

/// The result of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationResult {
    /// Index in `/outcomes` of the first command of the simulation.
    first_index: u64,
    /// The last computed step.
    pub steps: u64,
    /// Hash of the last state.
    pub state_hash: u64,
    /// Number of applied commands.
    pub applied_count: u64,
    /// Number of rejected commands.
    pub rejected_count: u64,
    /// The outcomes of the first 5 rejected commands.
    pub rejections: Vec<Outcome>,
    /// The steps that computed only a part of the contacts, because particles were piled up too densely.
    pub incomplete_contacts: Option<StepCount>,
}

/// The number of steps with a property, and the first of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepCount {
    /// The first of the steps.
    pub first_step: u64,
    /// Number of the steps.
    pub count: u64,
}

/// Most outcomes of rejected commands that a result lists.
const REJECTIONS_SHOWN_MAX: usize = 5;

impl SimulationResult {
    pub(super) fn at_start(start: Start, solver: &Solver) -> Self {
        Self {
            first_index: start.outcome_count,
            steps: start.step,
            state_hash: solver.state_hash(),
            applied_count: 0,
            rejected_count: 0,
            rejections: Vec::new(),
            incomplete_contacts: None,
        }
    }

    pub(super) fn count_incomplete_contacts(&mut self, step: u64) {
        let steps =
            self.incomplete_contacts.get_or_insert(StepCount { first_step: step, count: 0 });
        steps.count += 1;
    }

    /// Counts a command at the boundary before `step`, and returns its outcome.
    pub(super) fn count(
        &mut self,
        command: &TimedCommand,
        step: u64,
        result: Result<(), Reason>,
    ) -> Outcome {
        let TimedCommand { client_id, sequence, action, .. } = *command;
        let index = self.first_index + self.applied_count + self.rejected_count;
        let outcome = Outcome::new(index, step, Command::new(client_id, sequence, action), result);
        self.applied_count += u64::from(outcome.is_applied());
        if !outcome.is_applied() {
            self.rejected_count += 1;
            let is_shown = self.rejections.len() < REJECTIONS_SHOWN_MAX;
            self.rejections.extend(is_shown.then_some(outcome));
        }
        outcome
    }
}
