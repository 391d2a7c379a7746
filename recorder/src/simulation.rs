//! A scene and commands, stepped in this process and written as a live run would be.

use std::io::Write;
use std::ops::ControlFlow;

use bytemuck::cast;
use recorder::{
    LogWriter, Message, OutcomeRow, RunDescription, StepRow, SurfaceRow, TopologyRow, WriteError,
};
use sim_contract::{
    Action, CONTRACT_VERSION, Command, ConstraintState, LoadHeader, Outcome, Triangle,
};
use sim_solver::{SOLVER_VERSION, Scene, Solver};
use xxhash_rust::xxh3::Xxh3;

use crate::apply::apply;
use crate::command_file::TimedCommand;

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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Outcomes {
    /// Steps made.
    pub(crate) steps: u64,
    /// Hash of the last state.
    pub(crate) state_hash: u64,
    pub(crate) applied_count: u64,
    pub(crate) rejected_count: u64,
}

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
    let mut writer = log.map(|log| Writer::new(log, job, &solver)).transpose()?;
    let mut outcomes = Outcomes::at_start(&solver);
    if let Some(writer) = &mut writer {
        writer.write_state(&solver, 0, KeyframeDue::Now)?;
    }
    let mut waiting = job.commands.as_slice();
    for step in 1..=job.steps {
        let mut keyframe = KeyframeDue::OnTheSecond;
        let mut rows = Vec::new();
        while let Some((command, rest)) = waiting.split_first().filter(|(c, _)| c.step <= step) {
            let outcome = outcomes.apply(&mut solver, command);
            if outcome.is_applied() && !matches!(command.action, Action::Move { .. }) {
                keyframe = KeyframeDue::Now;
            }
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
        Self { steps: 0, state_hash: solver.state_hash(), applied_count: 0, rejected_count: 0 }
    }

    fn apply(&mut self, solver: &mut Solver, command: &TimedCommand) -> Outcome {
        let TimedCommand { step, client_id, sequence, action, .. } = *command;
        let result = apply(solver, client_id, action);
        let index = self.applied_count + self.rejected_count;
        let outcome = Outcome::new(index, step, Command::new(client_id, sequence, action), result);
        self.applied_count += u64::from(outcome.is_applied());
        self.rejected_count += u64::from(!outcome.is_applied());
        outcome
    }
}

/// When the state is to be written completely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum KeyframeDue {
    /// With this step.
    Now,
    /// If this step is a whole second.
    OnTheSecond,
}

/// Writes a simulation step by step, in the order in which a node publishes.
struct Writer<'a, W: Write> {
    log: &'a mut LogWriter<W>,
    run: RunDescription,
    /// Those of the step that comes next.
    outcomes: Vec<OutcomeRow>,
    outcome_count: u64,
}

impl<'a, W: Write> Writer<'a, W> {
    fn new(log: &'a mut LogWriter<W>, job: &Job, solver: &Solver) -> Result<Self, WriteError> {
        let run = job.description(solver);
        let header = LoadHeader { method: run.method, ..LoadHeader::default() };
        let constraints: Vec<_> = solver.constraints().map(constraint_state).collect();
        let triangles: Vec<_> =
            solver.triangles().iter().map(|corners| Triangle { corners: *corners }).collect();
        log.write(&Message::Topology(TopologyRow::new(&header, &constraints)), 0)?;
        log.write(&Message::Surface(SurfaceRow::new(&header, &triangles)), 0)?;
        Ok(Self { log, run, outcomes: Vec::new(), outcome_count: 0 })
    }

    fn write_state(
        &mut self,
        solver: &Solver,
        step: u64,
        keyframe: KeyframeDue,
    ) -> Result<(), WriteError> {
        let time_ns = self.run.time_of_step_ns(step);
        let is_second = step.is_multiple_of(u64::from(self.run.rate_hz));
        // By simulated seconds, not by those of the wall: equal inputs give equal files.
        if is_second && step > 0 {
            self.log.flush()?;
        }
        if is_second || keyframe == KeyframeDue::Now {
            let bytes = solver.keyframe().encode();
            self.log.write(&Message::Keyframe { step, bytes }, time_ns)?;
        }
        for row in self.outcomes.drain(..) {
            self.outcome_count += 1;
            self.log.write(&Message::Outcome(row), time_ns)?;
        }
        self.log.write(&Message::Step(self.row(solver, step)), time_ns)?;
        let particles = (0..solver.particle_count()).map(|index| cast(solver.particle(index)));
        self.log.write(&Message::Particles { step, particles: particles.collect() }, time_ns)
    }

    fn row(&self, solver: &Solver, step: u64) -> StepRow {
        StepRow {
            step,
            scene_step: solver.scene_step(),
            state_hash: solver.state_hash(),
            topology_revision: 0,
            torn_count: count(solver.torn().len()),
            outcome_count: self.outcome_count,
            wake_late_ns: 0,
            solve_ns: 0,
        }
    }
}

fn constraint_state(constraint: sim_solver::Constraint) -> ConstraintState {
    ConstraintState {
        a: constraint.a,
        b: constraint.b,
        rest_length: constraint.rest_length,
        compliance: constraint.compliance,
        kind: constraint.kind as u32,
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 of anything")]
fn count(length: usize) -> u32 {
    length as u32
}
