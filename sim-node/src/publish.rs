//! From the solver's state to what other processes read.

mod load;

use anyhow::Context;
use bytemuck::cast;
use sim_contract::clock::{SECOND_NS, monotonic_ns};
use sim_contract::{
    CONTRACT_VERSION, CollidersHeader, Command, Endpoint, KeyframeHeader, NodeStatus, Outcome,
    Owner, OwnerError, ParameterValues, ParticleState, Reason, SnapshotFlags, SnapshotHeader,
    StatusFlags, TearsHeader, TornConstraint, Wake,
};
use sim_solver::{Applied, PlacedCollider, SOLVER_VERSION, Scene, Solver};

use crate::statistics::Statistics;
use load::{LoadPlace, count, to_collider_state, with_load};

/// How long a step took and how late it began.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepTimes {
    pub(crate) wake_late_ns: u64,
    pub(crate) solve_ns: u64,
}

/// Where the run stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Position {
    pub(crate) step: u64,
    pub(crate) is_paused: bool,
    /// The pace against real time.
    pub(crate) time_scale: f64,
    /// No further step follows for now: whoever joins is to see this one.
    pub(crate) is_last: bool,
}

/// Writes snapshots, keyframes, outcomes and status.
#[derive(Debug)]
pub(crate) struct Publisher {
    owner: Owner,
    run_id: u64,
    rate_hz: u32,
    /// Loads of this run after the first one.
    topology_revision: u32,
    /// Every how many steps a snapshot is published; the last one before a wait always is.
    every: u64,
    /// Header of the newest published snapshot.
    last: SnapshotHeader,
    /// A keyframe is to go with the next snapshot.
    is_keyframe_due: bool,
    keyframe_step: u64,
    keyframe_readers: usize,
    /// Outcomes of the boundary that is waiting, not yet published.
    outcomes: Vec<Outcome>,
    outcome_count: u64,
    rejected_count: u64,
    /// The parameters that were published last.
    parameters: ParameterValues,
    /// How many torn constraints, and which colliders, were published last.
    torn_count: usize,
    colliders: Vec<PlacedCollider>,
}

impl Publisher {
    /// Takes the name and publishes the scene.
    pub(crate) fn new(
        endpoint: &Endpoint,
        scene: &Scene,
        solver: &Solver,
        every: u64,
    ) -> anyhow::Result<Self> {
        let run_id = getrandom::u64().context("no random number for the run")?;
        let parameters = parameter_values(solver, 1.0);
        let place = LoadPlace { run_id, step: 0, topology_revision: 0, parameters };
        let owner = with_load(scene, solver, place, |load| Owner::create(endpoint, load))?;
        Ok(Self {
            owner,
            run_id,
            rate_hz: scene.solver.rate_hz,
            topology_revision: 0,
            every,
            last: SnapshotHeader::default(),
            is_keyframe_due: true,
            keyframe_step: 0,
            keyframe_readers: 0,
            outcomes: Vec::new(),
            outcome_count: 0,
            rejected_count: 0,
            parameters,
            torn_count: 0,
            colliders: Vec::new(),
        })
    }

    /// Publishes another scene, which `step` is the first to show.
    ///
    /// # Errors
    /// It is beyond a limit of the contract or of shared memory; the old one stays published.
    pub(crate) fn load(
        &mut self,
        scene: &Scene,
        solver: &Solver,
        step: u64,
        time_scale: f64,
    ) -> Result<(), OwnerError> {
        let topology_revision = self.topology_revision + 1;
        let parameters = parameter_values(solver, time_scale);
        let place = LoadPlace { run_id: self.run_id, step, topology_revision, parameters };
        with_load(scene, solver, place, |load| self.owner.load(load))?;
        self.parameters = parameters;
        self.topology_revision = topology_revision;
        self.torn_count = 0;
        self.colliders.clear();
        Ok(())
    }

    /// Appends the commands that have arrived.
    pub(crate) fn receive_commands(&self, commands: &mut Vec<Command>) {
        self.owner.receive_commands(commands);
    }

    /// Logs what became of a command at the boundary before `step`.
    pub(crate) fn add_outcome(
        &mut self,
        step: u64,
        command: Command,
        result: Result<Applied, Reason>,
    ) {
        let outcome = Outcome::new(self.outcome_count, step, command, result.map(|_| ()));
        self.outcomes.push(Outcome { run_id: self.run_id, ..outcome });
        self.outcome_count += 1;
        self.rejected_count += u64::from(result.is_err());
        self.is_keyframe_due |= result.is_ok_and(|applied| applied != Applied::Target);
    }

    /// Publishes what belongs to a step, the particles last, and wakes the readers.
    pub(crate) fn publish_step(
        &mut self,
        solver: &Solver,
        position: Position,
        times: StepTimes,
    ) -> anyhow::Result<()> {
        self.is_keyframe_due |= position.step.is_multiple_of(u64::from(self.rate_hz));
        self.publish_colliders(solver, position.step)?;
        self.publish_tears(solver, position.step)?;
        if !(position.step.is_multiple_of(self.every) || position.is_last) {
            return self.publish_outcomes();
        }
        self.watch_keyframe_readers();
        if self.is_keyframe_due {
            self.publish_keyframe(solver, position)?;
        }
        self.publish_outcomes()?;
        self.last = self.header(solver, position, times);
        let particle = |index| cast::<_, ParticleState>(solver.particle(index));
        self.owner.publish_particles(&self.last, particle)?;
        self.owner.wake(Wake::Frame);
        Ok(())
    }

    /// Publishes the colliders where they are not what was published last.
    fn publish_colliders(&mut self, solver: &Solver, step: u64) -> anyhow::Result<()> {
        if solver.colliders().eq(self.colliders.iter().copied()) {
            return Ok(());
        }
        self.colliders.clear();
        self.colliders.extend(solver.colliders());
        let states: Vec<_> = self.colliders.iter().map(to_collider_state).collect();
        let header = CollidersHeader { run_id: self.run_id, step, ..CollidersHeader::default() };
        Ok(self.owner.publish_colliders(header, &states)?)
    }

    /// Publishes all that is torn, where something tore in this step or is whole again.
    fn publish_tears(&mut self, solver: &Solver, step: u64) -> anyhow::Result<()> {
        let (torn, new_count) = (solver.torn(), solver.new_torn_count());
        if new_count == 0 && torn.len() == self.torn_count {
            return Ok(());
        }
        self.torn_count = torn.len();
        let header = TearsHeader {
            run_id: self.run_id,
            step,
            since_step: step - solver.scene_step(),
            new_count: count(new_count),
            ..TearsHeader::default()
        };
        let torn: Vec<_> = torn
            .iter()
            .zip(solver.tear_causes())
            .map(|(constraint, cause)| TornConstraint::new(*constraint, Some(*cause)))
            .collect();
        self.owner.publish_tears(header, &torn)?;
        self.owner.wake(Wake::Tears);
        Ok(())
    }

    /// Publishes the parameters if they differ from the ones published last. `step` is the first
    /// step that they apply to.
    pub(crate) fn publish_parameters(
        &mut self,
        solver: &Solver,
        step: u64,
        time_scale: f64,
    ) -> anyhow::Result<()> {
        let values = parameter_values(solver, time_scale);
        if values == self.parameters {
            return Ok(());
        }
        self.parameters = values;
        Ok(self.owner.publish_parameters(self.run_id, step, &values)?)
    }

    /// Publishes what can be published while the node waits: outcomes, and a keyframe of the last
    /// snapshot for a reader that has joined since. Once a command has touched the state that
    /// waits, there is no keyframe of that snapshot any more, and the reader gets the next one.
    pub(crate) fn publish_between(
        &mut self,
        solver: &Solver,
        position: Position,
    ) -> anyhow::Result<()> {
        self.watch_keyframe_readers();
        let is_untouched =
            self.last.step == position.step && self.last.outcome_count == self.outcome_count;
        if self.is_keyframe_due && is_untouched {
            self.publish_keyframe(solver, position)?;
            self.owner.wake(Wake::Frame);
        }
        self.publish_outcomes()
    }

    fn publish_outcomes(&mut self) -> anyhow::Result<()> {
        if self.outcomes.is_empty() {
            return Ok(());
        }
        for outcome in self.outcomes.drain(..) {
            self.owner.publish_outcome(&outcome)?;
        }
        self.owner.wake(Wake::Outcome);
        Ok(())
    }

    fn watch_keyframe_readers(&mut self) {
        let readers = self.owner.keyframe_reader_count();
        self.is_keyframe_due |= readers > self.keyframe_readers;
        self.keyframe_readers = readers;
    }

    fn publish_keyframe(&mut self, solver: &Solver, position: Position) -> anyhow::Result<()> {
        let mut keyframe = solver.keyframe();
        keyframe.paused = position.is_paused;
        let bytes = keyframe.encode();
        let header = KeyframeHeader {
            run_id: self.run_id,
            step: position.step,
            size_bytes: bytes.len() as u64,
        };
        self.owner.publish_keyframe(header, &bytes)?;
        self.is_keyframe_due = false;
        self.keyframe_step = position.step;
        Ok(())
    }

    fn header(&self, solver: &Solver, position: Position, times: StepTimes) -> SnapshotHeader {
        SnapshotHeader {
            contract_version: CONTRACT_VERSION,
            solver_version: SOLVER_VERSION,
            run_id: self.run_id,
            step: position.step,
            scene_step: solver.scene_step(),
            keyframe_step: self.keyframe_step,
            sim_time_ns: time_of_step_ns(position.step, self.rate_hz),
            publish_monotonic_ns: monotonic_ns(),
            state_hash: solver.state_hash(),
            outcome_count: self.outcome_count,
            wake_late_ns: times.wake_late_ns,
            solve_ns: times.solve_ns,
            topology_revision: self.topology_revision,
            torn_count: count(solver.torn().len()),
            particle_count: count(solver.particle_count()),
            flags: if position.is_paused { SnapshotFlags::PAUSED } else { 0 },
            stride: u32::try_from(self.every).unwrap_or(u32::MAX),
            spare: 0,
        }
    }

    /// Lets late joiners have what is written seldom.
    pub(crate) fn refresh(&self) {
        self.owner.refresh();
    }

    pub(crate) fn publish_status(&self, status: &NodeStatus) -> anyhow::Result<()> {
        self.owner.publish_status(status)?;
        self.owner.wake(Wake::Status);
        Ok(())
    }

    /// How the node does.
    pub(crate) fn status(
        &self,
        scene: &Scene,
        solver: &Solver,
        position: Position,
        statistics: &Statistics,
    ) -> NodeStatus {
        let last = &statistics.last;
        let mut status = NodeStatus {
            contract_version: CONTRACT_VERSION,
            solver_version: SOLVER_VERSION,
            run_id: self.run_id,
            step: position.step,
            real_time_factor: if position.is_paused { 0.0 } else { statistics.real_time_factor },
            wake_late_ns_p50: last.wake_late_ns(0.5),
            wake_late_ns_p99: last.wake_late_ns(0.99),
            solve_ns_p50: last.solve_ns(0.5),
            solve_ns_p99: last.solve_ns(0.99),
            late_steps: statistics.late_steps,
            skipped_periods: statistics.skipped_periods,
            outcome_count: self.outcome_count,
            rejected_count: self.rejected_count,
            rate_hz: self.rate_hz,
            particle_count: count(solver.particle_count()),
            constraint_count: count(solver.constraint_count()),
            reader_count: count(self.owner.reader_count()),
            process_id: std::process::id(),
            time_scale: position.time_scale,
            frozen_count: solver.frozen_count(),
            torn_count: count(solver.torn().len()),
            flags: if position.is_paused { StatusFlags::PAUSED } else { 0 },
            ..NodeStatus::default()
        };
        status.set_scene_name(&scene.name);
        status
    }
}

/// The parameters of a solver that a node steps at this pace.
fn parameter_values(solver: &Solver, time_scale: f64) -> ParameterValues {
    #[allow(clippy::cast_possible_truncation, reason = "`set` gave it as an f32")]
    let time_scale = time_scale as f32;
    ParameterValues { time_scale, ..solver.parameter_values() }
}

/// step / rate in nanoseconds, rounded down; whole seconds apart, so that nothing overflows.
fn time_of_step_ns(step: u64, rate_hz: u32) -> u64 {
    let rate_hz = u64::from(rate_hz);
    step / rate_hz * SECOND_NS + step % rate_hz * SECOND_NS / rate_hz
}
