//! A scene and commands, stepped in this process and written as a live run would be.

mod writer;

use std::io::Write;
use std::ops::ControlFlow;

use recorder::{LogWriter, OutcomeRow, RunDescription, WriteError};
use sim_contract::{CONTRACT_VERSION, Command, Outcome, Reason};
use sim_solver::{Applied, SOLVER_VERSION, Scene, Solver};
use xxhash_rust::xxh3::Xxh3;

use crate::apply::apply;
use crate::command_file::TimedCommand;
use writer::{KeyframeDue, StateWriter};

/// What is simulated.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) scene: Scene,
    /// In the order of application.
    pub(crate) commands: Vec<TimedCommand>,
    /// Steps to make after step 0.
    pub(crate) steps: u64,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcomes {
    /// Steps made.
    pub(crate) steps: u64,
    /// Hash of the last state.
    pub(crate) state_hash: u64,
    pub(crate) applied_count: u64,
    pub(crate) rejected_count: u64,
    /// The first of the rejected ones, at most [`REJECTIONS_SHOWN_MAX`].
    pub(crate) rejections: Vec<Outcome>,
}

/// Rejected commands that are named one by one.
const REJECTIONS_SHOWN_MAX: usize = 5;

impl Job {
    /// Commands that no step is left for.
    pub(crate) fn commands_beyond_the_end(&self) -> usize {
        self.commands.iter().filter(|command| command.step > self.steps).count()
    }

    /// The run as a recording of it says.
    pub(crate) fn description(&self, solver: &Solver) -> RunDescription {
        RunDescription {
            run_id: self.run_id(),
            epoch_ns: 0,
            scene_name: self.scene.name.clone(),
            origin: self.scene.origin,
            rate_hz: self.scene.solver.rate_hz,
            method: self.scene.solver.method as u32,
            particle_count: count(solver.particle_count()),
            constraint_count: count(solver.constraint_count()),
            solver_version: SOLVER_VERSION,
            contract_version: CONTRACT_VERSION,
            recorder_version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// Equal inputs, equal number: the hash of the scene and of what each command is.
    fn run_id(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(self.scene.to_toml().as_bytes());
        for command in &self.commands {
            let wire = Command::new(command.client_id, command.sequence, command.action);
            hash.update(&command.step.to_le_bytes());
            hash.update(bytemuck::bytes_of(&wire));
        }
        hash.digest()
    }
}

/// Makes the steps of `job` and writes them to `log`. `on_step` is called after each and may end
/// it early.
pub(crate) fn simulate<W: Write>(
    job: &Job,
    mut solver: Solver,
    log: Option<&mut LogWriter<W>>,
    mut on_step: impl FnMut(u64) -> ControlFlow<()>,
) -> Result<Outcomes, WriteError> {
    let mut writer = log.map(|log| StateWriter::new(log, job, &solver)).transpose()?;
    let mut outcomes = Outcomes::at_start(&solver);
    if let Some(writer) = &mut writer {
        writer.write_state(&solver, 0, KeyframeDue::Now)?;
    }
    let mut waiting = job.commands.as_slice();
    for step in 1..=job.steps {
        let mut keyframe = KeyframeDue::OnTheSecond;
        let mut rows = Vec::new();
        while let Some((command, rest)) = waiting.split_first().filter(|(c, _)| c.step <= step) {
            let result = apply(&mut solver, command.client_id, &command.action);
            if result.is_ok_and(|applied| applied != Applied::Target) {
                keyframe = KeyframeDue::Now;
            }
            let outcome = outcomes.count(command, result.map(|_| ()));
            rows.push(OutcomeRow::from(&outcome));
            waiting = rest;
        }
        solver.step();
        outcomes.steps = step;
        if let Some(writer) = &mut writer {
            writer.outcomes = rows;
            writer.write_state(&solver, step, keyframe)?;
        }
        if on_step(step).is_break() {
            break;
        }
    }
    outcomes.state_hash = solver.state_hash();
    Ok(outcomes)
}

impl Outcomes {
    fn at_start(solver: &Solver) -> Self {
        Self {
            steps: 0,
            state_hash: solver.state_hash(),
            applied_count: 0,
            rejected_count: 0,
            rejections: Vec::new(),
        }
    }

    /// Counts a command and returns its outcome.
    fn count(&mut self, command: &TimedCommand, result: Result<(), Reason>) -> Outcome {
        let TimedCommand { step, client_id, sequence, action, .. } = *command;
        let index = self.applied_count + self.rejected_count;
        let outcome = Outcome::new(index, step, Command::new(client_id, sequence, action), result);
        self.applied_count += u64::from(outcome.is_applied());
        if !outcome.is_applied() {
            self.rejected_count += 1;
            let shown = self.rejections.len() < REJECTIONS_SHOWN_MAX;
            self.rejections.extend(shown.then_some(outcome));
        }
        outcome
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 of anything")]
fn count(length: usize) -> u32 {
    length as u32
}
