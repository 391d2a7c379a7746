//! The inputs of a simulation.

use crate::log::{RunDescription, TimedCommand};
use sim_contract::CONTRACT_VERSION;
use sim_solver::{SOLVER_VERSION, Scene, Solver};

use super::run_id::RunId;

/// The inputs of a simulation.
#[derive(Debug)]
pub struct Job {
    /// The scene.
    pub scene: Scene,
    /// In the order of application.
    pub commands: Vec<TimedCommand>,
    /// The last step to compute.
    pub steps: u64,
    /// The state before the first step to compute.
    pub start: Start,
}

/// The state before the first step to compute. The default is that of step 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Start {
    /// The step of the state.
    pub step: u64,
    /// Number of the commands of the run up to this state.
    pub outcome_count: u64,
}

impl Job {
    /// A simulation from step 0.
    pub fn new(scene: Scene, commands: Vec<TimedCommand>, steps: u64) -> Self {
        Self { scene, commands, steps, start: Start::default() }
    }

    /// Returns the number of commands whose step is after the last one.
    pub fn commands_beyond_the_end(&self) -> usize {
        self.commands.iter().filter(|command| command.step > self.steps).count()
    }

    /// Returns the metadata of a recording of this simulation.
    pub fn description(&self, solver: &Solver) -> RunDescription {
        RunDescription {
            run_id: self.run_id(),
            epoch_ns: 0,
            scene_name: self.scene.name.clone(),
            origin: self.scene.origin,
            up: self.scene.up,
            rate_hz: self.scene.solver.rate_hz,
            method: self.scene.solver.method as u32,
            particle_count: count(solver.particle_count()),
            constraint_count: count(solver.constraint_count()),
            bend_count: count(solver.bend_count()),
            solver_version: SOLVER_VERSION,
            contract_version: CONTRACT_VERSION,
            recorder_version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// Returns the id of the run. Commands after the last step have no part in it.
    fn run_id(&self) -> u64 {
        let mut id = RunId::new(self.scene.to_toml().as_bytes());
        if self.start != Start::default() {
            id.add_start(self.start.step, self.start.outcome_count);
        }
        for command in self.commands.iter().filter(|command| command.step <= self.steps) {
            id.add(command.step, command.client_id, command.sequence, command.action);
        }
        id.value()
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 elements of a kind")]
pub(super) fn count(length: usize) -> u32 {
    length as u32
}
