//! The recording of a solver that the caller steps, in a file.

use std::path::{Path, PathBuf};

use sim_host::{Existing, PartFile, PartFileError};
use sim_messages::{Action, Reason};
use sim_solver::{Applied, Scene, Solver};

use super::job::{Job, RunId, SimulationResult, Start};
use super::state_writer::{StateWriter, begin_log, finish_log};
use crate::log::{
    ContentSelection, LogOptions, LogWriter, RunDescription, TimedCommand, WriteError,
    replace_run_id,
};

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
mod tests {
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
