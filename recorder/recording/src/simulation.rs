//! Steps a scene with commands in this process and writes the recording of a live run.

mod job;
pub(crate) mod state_writer;
#[cfg(feature = "files")]
mod stepped_recording;

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use sim_messages::{Action, Reason};
use sim_solver::Solver;

use super::log::{LogWriter, TimedCommand, WriteError};
use job::KeptStates;
pub use job::{Job, SimulationResult, Start, State, StepCount, apply};
use state_writer::StateWriter;
pub use state_writer::{
    FrozenParticles, FrozenTracker, begin_log, colliders_row, finish_log, forces_row,
    recording_bytes, step_row,
};
#[cfg(feature = "files")]
pub use stepped_recording::{SteppedRecording, SteppedRecordingError};

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
    mut log: Option<&mut LogWriter<W>>,
    stop: &AtomicBool,
    mut on_step: impl FnMut(u64),
) -> Result<SimulationResult, E> {
    let States { mut solver, mut given } = states;
    let Start { step: first_step, .. } = job.start;
    let run = job.description(&solver);
    let begin = |log: &mut LogWriter<W>| {
        let mut writer = StateWriter::new(log, &run, &job.scene, job.start, &solver)?;
        writer.write_state(log, &solver, first_step)?;
        Ok::<_, WriteError>(writer)
    };
    let mut writer = log.as_deref_mut().map(begin).transpose()?;
    let mut result = SimulationResult::at_start(job.start, &solver);
    let mut pending = job.commands.as_slice();
    let mut kept = KeptStates::for_commands(pending);
    kept.add(first_step, &solver);
    for step in first_step + 1..=job.steps {
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
            let outcome = result.count(command, step, answer.map(|_| ()));
            if let Some(writer) = &mut writer {
                writer.add_outcome(&outcome, answer);
            }
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
        if let (Some(writer), Some(log)) = (&mut writer, &mut log) {
            writer.write_state(log, &solver, step)?;
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
