//! A simulation without a node: its inputs, the id of its run, its actions, the states that it keeps, and its result.

use std::collections::BTreeMap;

use sim_messages::{Action, CONTRACT_VERSION, Command, Outcome, Reason, RestoreContents};
use sim_solver::{Applied, Control, Keyframe, Particle, SOLVER_VERSION, Scene, Solver};
use xxhash_rust::xxh3::Xxh3;

use crate::log::{RunDescription, TimedCommand};

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

/// A hash of the scene and of the commands that were applied, so that equal inputs have equal ids.
#[derive(Clone)]
pub(crate) struct RunId(Xxh3);

impl RunId {
    /// Starts with the text of the complete scene.
    pub(crate) fn new(scene: &[u8]) -> Self {
        let mut hash = Xxh3::new();
        hash.update(scene);
        Self(hash)
    }

    /// Adds a command, in the order of application.
    pub(crate) fn add(&mut self, step: u64, client_id: u64, sequence: u64, action: Action) {
        let wire = Command::new(client_id, sequence, action);
        self.0.update(&step.to_le_bytes());
        self.0.update(bytemuck::bytes_of(&wire));
    }

    /// Adds the place of a first state that differs from the initial state of the scene.
    pub(crate) fn add_start(&mut self, step: u64, outcome_count: u64) {
        self.0.update(&step.to_le_bytes());
        self.0.update(&outcome_count.to_le_bytes());
    }

    /// Returns the id.
    pub(crate) fn value(&self) -> u64 {
        self.0.digest()
    }
}

impl std::fmt::Debug for RunId {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "RunId({:016x})", self.value())
    }
}

/// Applies an action at the boundary before a step. `pause`, `resume` and `step` have no effect
/// here. `load` is rejected, because a recording has one scene. The caller has the states of `rewind` and
/// `restore`; here they are rejected.
///
/// # Errors
/// The action is rejected and changes nothing.
pub fn apply(solver: &mut Solver, client_id: u64, action: &Action) -> Result<Applied, Reason> {
    match solver.apply(client_id, action)? {
        Applied::Control(Control::Load { .. } | Control::Rewind { .. } | Control::Restore) => {
            Err(Reason::NoEffectHere)
        }
        applied => Ok(applied),
    }
}

/// The result of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
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

/// The states of the steps that the commands of a simulation name. A node that keeps every step would have
/// them.
#[derive(Debug)]
pub(super) struct KeptStates {
    /// By step: the number of commands that are still to rewind to it, and the state once it is computed.
    by_step: BTreeMap<u64, (usize, Option<State>)>,
}

/// A complete state.
#[derive(Debug, Clone)]
pub struct State {
    /// The particles.
    pub particles: Vec<Particle>,
    /// The rest of the state.
    pub keyframe: Keyframe,
}

impl State {
    /// Puts the state in place, or only its positions and velocities if the action says so.
    pub(super) fn put_in_place(
        &self,
        solver: &mut Solver,
        action: &Action,
    ) -> Result<Applied, Reason> {
        let result = match action {
            Action::Restore { contents: RestoreContents::Motion, .. } => {
                solver.put_motion_in_place(&self.particles)
            }
            _ => solver.put_in_place(&self.particles, &self.keyframe),
        };
        result.map(|()| Applied::InPlace).map_err(|_| Reason::InvalidState)
    }
}

impl KeptStates {
    /// Keeps the states for these commands, which are in the order of application.
    pub(super) fn for_commands(commands: &[TimedCommand]) -> Self {
        let mut by_step = BTreeMap::new();
        for command in commands {
            if let Action::Rewind { to_step: Some(to_step), .. } = command.action {
                by_step.entry(to_step).or_insert((0, None)).0 += 1;
            }
        }
        Self { by_step }
    }

    /// Keeps the state after a step, if a command rewinds to it.
    pub(super) fn add(&mut self, step: u64, solver: &Solver) {
        if let Some((_, state)) = self.by_step.get_mut(&step) {
            let particles = solver.particles().to_vec();
            *state = Some(State { particles, keyframe: solver.keyframe() });
        }
    }

    /// Returns the state of a step, if it was computed.
    pub(super) fn take(&mut self, step: u64) -> Option<State> {
        let (use_count, state) = self.by_step.get_mut(&step)?;
        let state = state.clone()?;
        *use_count -= 1;
        if *use_count == 0 {
            self.by_step.remove(&step);
        }
        Some(state)
    }
}
