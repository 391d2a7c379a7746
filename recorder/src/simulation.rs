//! Steps a scene with commands in this process and writes the recording of a live run.

pub(crate) mod apply;
pub(crate) mod frozen;
mod job;
mod kept_states;
pub(crate) mod run_id;
pub(crate) mod solver_rows;
mod state_writer;

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::log::{LogWriter, OutcomeRow, TimedCommand, WriteError};
use sim_contract::{Action, Command, Outcome, Reason};
use sim_solver::{Applied, Solver};

use apply::apply;
pub use frozen::{FrozenParticles, FrozenTracker};
pub use job::{Job, Start};
use kept_states::KeptStates;
pub use kept_states::State;
pub use solver_rows::{colliders_row, forces_row};
use state_writer::{KeyframeDue, StateWriter};

/// The result of a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulationResult {
    /// Index of the first outcome.
    first_index: u64,
    /// The last computed step.
    pub steps: u64,
    /// Hash of the last state.
    pub state_hash: u64,
    /// Number of applied commands.
    pub applied_count: u64,
    /// Number of rejected commands.
    pub rejected_count: u64,
    /// The first rejected commands, at most 5.
    pub rejections: Vec<Outcome>,
    /// The steps that left contacts out, because particles were piled up too densely.
    pub incomplete_contacts: Option<StepCount>,
}

/// Some steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepCount {
    /// The first one.
    pub first_step: u64,
    /// Their number.
    pub count: u64,
}

/// Most rejected commands to report one by one.
const REJECTIONS_SHOWN_MAX: usize = 5;

/// The states of a simulation that it does not compute.
#[derive(Debug)]
pub struct States<G> {
    /// The first one.
    pub solver: Solver,
    /// Returns the one that a command puts in place, for a state that the simulation has not computed.
    pub given: G,
}

/// Returns the state of a command.
pub type GiveState = fn(&TimedCommand) -> Result<Option<State>, WriteError>;

impl States<GiveState> {
    /// Only the first state.
    pub fn first(solver: Solver) -> Self {
        Self { solver, given: |_| Ok(None) }
    }
}

/// Computes the steps of `job` and writes them to `log`. Calls `on_step` after each step. Ends early, even
/// within a step, if `stop` becomes true.
///
/// # Errors
/// If the file cannot be written, and those of `states.given`.
pub fn simulate<W: Write, E: From<WriteError>>(
    job: &Job,
    states: States<impl FnMut(&TimedCommand) -> Result<Option<State>, E>>,
    log: Option<&mut LogWriter<W>>,
    stop: &AtomicBool,
    mut on_step: impl FnMut(u64),
) -> Result<SimulationResult, E> {
    let States { mut solver, mut given } = states;
    let run = job.description(&solver);
    let Start { step: first_step, .. } = job.start;
    let mut writer = log.map(|log| StateWriter::new(log, run, job, &solver)).transpose()?;
    let mut result = SimulationResult::at_start(job.start, &solver);
    if let Some(writer) = &mut writer {
        writer.write_state(&solver, first_step, KeyframeDue::Now)?;
    }
    let mut pending = job.commands.as_slice();
    let mut kept = KeptStates::for_commands(pending);
    kept.add(first_step, &solver);
    for step in first_step + 1..=job.steps {
        let mut keyframe = KeyframeDue::OnTheSecond;
        let mut rows = Vec::new();
        while let Some((command, rest)) = pending.split_first().filter(|(c, _)| c.step <= step) {
            let kept_state = match command.action {
                Action::Rewind { to_step: Some(to_step), back_steps: None } => kept.take(to_step),
                _ => None,
            };
            let state = match kept_state {
                Some(state) => Some(state),
                None => given(command)?,
            };
            let answer = match (command.action, state) {
                (action, Some(state)) if puts_state_in_place(&action) => {
                    state.put_in_place(&mut solver, &action)
                }
                (Action::Rewind { to_step: Some(_), back_steps: None }, None) => {
                    Err(Reason::OutOfRange)
                }
                (action, _) => apply(&mut solver, command.client_id, &action),
            };
            if answer.is_ok_and(|applied| applied != Applied::Target) {
                keyframe = KeyframeDue::Now;
            }
            let outcome = result.count(command, step, answer.map(|_| ()));
            rows.push(OutcomeRow::from(&outcome));
            pending = rest;
            if puts_state_in_place(&command.action) && answer.is_ok() {
                // This step shows the state without further changes, as in a node.
                break;
            }
        }
        let overflow_count = solver.contact_overflow_count();
        if !solver.step_unless(stop) {
            break;
        }
        if solver.contact_overflow_count() > overflow_count {
            result.count_incomplete_contacts(step);
        }
        result.steps = step;
        kept.add(step, &solver);
        if let Some(writer) = &mut writer {
            writer.outcomes = rows;
            writer.write_state(&solver, step, keyframe)?;
        }
        on_step(step);
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    result.state_hash = solver.state_hash();
    Ok(result)
}

fn puts_state_in_place(action: &Action) -> bool {
    matches!(action, Action::Rewind { .. } | Action::Restore { .. })
}

impl SimulationResult {
    fn at_start(start: Start, solver: &Solver) -> Self {
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

    fn count_incomplete_contacts(&mut self, step: u64) {
        let steps =
            self.incomplete_contacts.get_or_insert(StepCount { first_step: step, count: 0 });
        steps.count += 1;
    }

    /// Counts a command at the boundary before `step`, and returns its outcome.
    fn count(&mut self, command: &TimedCommand, step: u64, result: Result<(), Reason>) -> Outcome {
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
