//! Steps a scene with commands in this process and writes the recording of a live run.

mod job;
pub(crate) mod state_writer;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use sim_host::{Existing, PartFile, PartFileError};
use sim_messages::{Action, Reason};
use sim_solver::{Applied, Scene, Solver};

use super::log::{
    ContentSelection, LogOptions, LogWriter, RunDescription, TimedCommand, WriteError,
    replace_run_id,
};
pub use job::{Job, SimulationResult, Start, State, StepCount, apply};
use job::{KeptStates, RunId};
use state_writer::StateWriter;
pub use state_writer::{
    FrozenParticles, FrozenTracker, begin_log, colliders_row, finish_log, forces_row,
    recording_bytes, step_row,
};

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

/// The reason why a simulation could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum SteppedRecordingError {
    /// The file cannot be created, or cannot get its name.
    #[error(transparent)]
    File(#[from] PartFileError),
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A recording that grows with each step of a solver.
#[derive(Debug)]
pub struct SteppedRecording {
    log: LogWriter<PartFile>,
    writer: StateWriter,
    /// The run that the file names so far. Its id depends on commands to come.
    run: RunDescription,
    run_id: RunId,
    result: SimulationResult,
    /// The commands since the last written step.
    commands: Vec<TimedCommand>,
    /// Number of commands.
    command_count: u64,
}

impl SteppedRecording {
    /// Creates the file, with the suffix `.part` until [`Self::finish`], and writes step 0. `solver` has the state of
    /// the scene at step 0. Forces are recorded if it computes them.
    ///
    /// # Errors
    /// A file with one of the two names exists and may not be replaced, or cannot be written.
    pub fn begin(
        path: &Path,
        existing: Existing,
        scene: &Scene,
        solver: &Solver,
    ) -> Result<Self, SteppedRecordingError> {
        let run = Job::new(scene.clone(), Vec::new(), 0).description(solver);
        let has_forces = solver.forces().is_some();
        let selection = ContentSelection { has_forces, ..ContentSelection::default() };
        let options = LogOptions { selection, ..LogOptions::default() };
        let file = PartFile::create(path, existing)?;
        let mut log = begin_log(file, options, &run, scene)?;
        let mut writer = StateWriter::new(&mut log, &run, scene, Start::default(), solver)?;
        writer.write_state(&mut log, solver, 0)?;
        Ok(Self {
            log,
            writer,
            run,
            run_id: RunId::new(scene.to_toml().as_bytes()),
            result: SimulationResult::at_start(Start::default(), solver),
            commands: Vec::new(),
            command_count: 0,
        })
    }

    /// Adds a command of the client 0 and its result, at the boundary before `step`.
    pub fn add_command(&mut self, step: u64, action: Action, result: Result<Applied, Reason>) {
        self.command_count += 1;
        let sequence = self.command_count;
        let command = TimedCommand { step, index: None, client_id: 0, sequence, action };
        let outcome = self.result.count(&command, step, result.map(|_| ()));
        self.writer.add_outcome(&outcome, result);
        self.commands.push(command);
    }

    /// Writes the state after a step.
    ///
    /// # Errors
    /// If the file cannot be written. It then ends before this step.
    pub fn write_step(&mut self, solver: &Solver, step: u64) -> Result<(), WriteError> {
        for command in self.commands.drain(..) {
            let TimedCommand { client_id, sequence, action, .. } = command;
            self.run_id.add(step, client_id, sequence, action);
        }
        self.writer.write_state(&mut self.log, solver, step)
    }

    /// Completes the file, and gives it its name. Commands without a step have no part in it.
    ///
    /// # Errors
    /// If the file cannot be written. The part of it that is written stays under its name with `.part`.
    pub fn finish(self) -> Result<PathBuf, SteppedRecordingError> {
        let file = finish_log(self.log, "steps reached")?;
        replace_run_id(file.part_path(), self.run.run_id, self.run_id.value())
            .map_err(WriteError::from)?;
        Ok(file.finish()?)
    }
}

#[cfg(test)]
mod stepped_recording_tests {
    use std::fs;
    use std::sync::atomic::AtomicBool;

    use sim_solver::builtin;

    use super::*;
    use crate::simulation::{States, apply, simulate};

    /// Commands at the boundaries before steps 3 and 11, one of them rejected.
    fn actions() -> [(u64, Action); 4] {
        [
            (3, Action::set("damping", 0.25)),
            (3, Action::Pin { particle: 1 << 20 }),
            (11, Action::Cut { constraint: 7 }),
            (11, Action::Reset),
        ]
    }

    fn simulated(commands: Vec<TimedCommand>, scene: &Scene) -> Vec<u8> {
        let job = Job::new(scene.clone(), commands, 300);
        let solver = Solver::new(scene);
        let run = job.description(&solver);
        let mut log = begin_log(Vec::new(), LogOptions::default(), &run, scene).unwrap();
        let stop = AtomicBool::new(false);
        simulate(&job, States::first(solver), Some(&mut log), &stop, |_| {}).unwrap();
        finish_log(log, "steps reached").unwrap()
    }

    #[test]
    fn a_simulation_that_is_stepped_has_the_bytes_of_simulate() {
        let scene = Scene::from_toml(builtin::text("carried-cloth").unwrap(), "cloth").unwrap();
        let path = std::env::temp_dir().join(format!("stepped-{}.mcap", std::process::id()));
        for commands in [&actions()[..], &[]] {
            let mut solver = Solver::new(&scene);
            let mut recording =
                SteppedRecording::begin(&path, Existing::Overwrite, &scene, &solver).unwrap();
            for step in 1..=300 {
                for (_, action) in commands.iter().filter(|(at, _)| *at == step) {
                    let result = apply(&mut solver, 0, action);
                    recording.add_command(step, *action, result);
                }
                solver.step();
                recording.write_step(&solver, step).unwrap();
            }
            // It has no step.
            recording.add_command(301, Action::Reset, Ok(Applied::InPlace));
            let bytes = fs::read(recording.finish().unwrap()).unwrap();
            let timed = (1..).zip(commands).map(|(sequence, (step, action))| TimedCommand {
                step: *step,
                index: None,
                client_id: 0,
                sequence,
                action: *action,
            });
            assert!(bytes == simulated(timed.collect(), &scene), "{} commands", commands.len());
        }
        fs::remove_file(path).unwrap();
    }
}
