//! Publishes the state of the solver to other processes.

mod forces;
mod load;
pub(super) mod run;
mod status;

use std::path::PathBuf;

use anyhow::Context;
use bytemuck::cast_slice;
use sim_contract::{
    CONTRACT_VERSION, ColliderState, CollidersHeader, Command, ConnectionId, Endpoint,
    ForcesHeader, KeyframeHeader, LoadPreparer, OUTCOME_FLAG_DISCONNECTED, Outcome, Owner,
    OwnerError, Parameter, ParameterValues, ParticleState, Ready, Reason, ReceivedCommand,
    SnapshotFlags, SnapshotHeader, TearsHeader, TornConstraint, Wake,
};
use sim_host::clock::{SECOND_NS, monotonic_ns};
use sim_solver::{Applied, SOLVER_VERSION, Scene, Solver};

use super::inbox::Given;
use super::statistics::{Phase, Phases};
use forces::ForcesPublisher;
pub(super) use load::LoadMessages;
pub(crate) use load::shared_memory_bytes;
use load::{LoadPlace, count, to_collider_state};

/// Solver time and lateness of a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepTimes {
    pub(crate) wake_late_ns: u64,
    pub(crate) solve_ns: u64,
}

/// Position of the run and state of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Position {
    pub(crate) step: u64,
    pub(crate) is_paused: bool,
    /// Simulated time per wall-clock time.
    pub(crate) time_scale: f64,
    /// No further step follows for now, so late subscribers need this one.
    pub(crate) is_last: bool,
}

/// Numbers of readers of two services.
#[derive(Debug, Clone, Copy, Default)]
struct ReaderCounts {
    keyframe: usize,
    particles: usize,
}

/// Writes snapshots, keyframes, outcomes and status.
#[derive(Debug)]
pub(crate) struct Publisher {
    owner: Owner,
    run_id: u64,
    rate_hz: u32,
    scene_hash: u64,
    /// Loads of this run after the first one.
    topology_revision: u32,
    /// Number of steps between published snapshots. The last one before a pause, and states
    /// that commands put in place, are published too.
    every: u64,
    /// Times of the last step.
    times: StepTimes,
    /// Header of the newest published snapshot.
    last: SnapshotHeader,
    /// Number of outcomes after which the state still equals this snapshot.
    same_state_count: u64,
    /// Number of published snapshots, modulo 2^32.
    snapshot_count: u32,
    /// Number of the next snapshots that need a keyframe: two for a reader that has joined, because it is counted before it
    /// can receive the first one.
    keyframes_due: u32,
    /// A reader has joined since the newest keyframe.
    is_reader_waiting: bool,
    /// Header and bytes of the newest keyframe, which is latched.
    keyframe: KeyframeHeader,
    keyframe_bytes: Vec<u8>,
    readers: ReaderCounts,
    /// A reader has joined the keyframes, and perhaps not yet the particles.
    is_reader_joining: bool,
    /// Outcomes of the waiting boundary that are not published yet.
    outcomes: Vec<Outcome>,
    outcome_count: u64,
    rejected_count: u64,
    /// Last published parameters.
    parameters: ParameterValues,
    /// All torn constraints as last published, with room for every constraint of the load.
    torn: Vec<TornConstraint>,
    /// First step of the last load, or step of the last complete state that a command put in place. The
    /// torn constraints of the state count as torn in it.
    since_step: u64,
    /// The newest step whose state a command has put in place, perhaps with the motion only. Its snapshot is published,
    /// whatever `every` says.
    in_place_step: u64,
    /// The colliders as last published, with room for all of the load.
    colliders: Vec<ColliderState>,
    forces: ForcesPublisher,
    /// Times of the phases of steps, for `bench`.
    pub(crate) phases: Phases,
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
        let place =
            LoadPlace { run_id, step: 0, topology_revision: 0, parameters: parameters.clone() };
        let messages = LoadMessages::new(scene, solver);
        messages.check_memory()?;
        let owner = Owner::create(endpoint, &messages.at(place))?;
        Ok(Self {
            owner,
            run_id,
            rate_hz: scene.solver.rate_hz,
            scene_hash: messages.scene_hash(),
            topology_revision: 0,
            every,
            times: StepTimes::default(),
            last: SnapshotHeader::default(),
            same_state_count: 0,
            snapshot_count: 0,
            keyframes_due: 1,
            is_reader_waiting: false,
            keyframe: KeyframeHeader::default(),
            keyframe_bytes: Vec::new(),
            readers: ReaderCounts::default(),
            is_reader_joining: false,
            outcomes: Vec::new(),
            outcome_count: 0,
            rejected_count: 0,
            parameters,
            torn: Vec::with_capacity(solver.constraint_count()),
            since_step: 0,
            in_place_step: 0,
            colliders: Vec::with_capacity(solver.collider_count()),
            forces: ForcesPublisher::default(),
            phases: Phases::default(),
        })
    }

    /// Returns a handle with which another thread takes the memory of a load.
    pub(crate) fn preparer(&self) -> LoadPreparer {
        self.owner.preparer()
    }

    /// Appends the commands that have arrived.
    pub(crate) fn receive_commands(&self, commands: &mut Vec<ReceivedCommand>) {
        self.owner.receive_commands(commands);
    }

    /// Same as [`Owner::receive_states`].
    pub(crate) fn receive_states(&self) -> Vec<(ReceivedCommand, Given)> {
        let mut states = Vec::new();
        self.owner.receive_states(&mut states);
        states
    }

    /// Notes that a coming step shows a state that a command has put in place.
    pub(crate) fn show_in_place(&mut self, step: u64) {
        self.in_place_step = step;
    }

    /// Returns `true` for the newest step whose state a command has put in place. Step 0 of a run is excluded.
    pub(crate) fn is_in_place(&self, step: u64) -> bool {
        step > 0 && step == self.in_place_step
    }

    /// Returns `true` if the newest published snapshot belongs to a step, and says that a command has put its state in place.
    pub(crate) fn has_published_in_place(&self, step: u64) -> bool {
        self.has_published(step) && self.last.flags & SnapshotFlags::IN_PLACE != 0
    }

    /// Identifies the scene.
    pub(crate) fn scene_hash(&self) -> u64 {
        self.scene_hash
    }

    /// Same as [`Owner::receive_ready`].
    pub(crate) fn receive_ready(&self, receive: impl FnMut(Ready, ConnectionId)) {
        self.owner.receive_ready(receive);
    }

    /// Same as [`Owner::listed_members`].
    pub(crate) fn listed_members(&self) -> Vec<ConnectionId> {
        self.owner.listed_members()
    }

    /// Same as [`Owner::living_members`].
    pub(crate) fn living_members(&self) -> Vec<ConnectionId> {
        self.owner.living_members()
    }

    /// Returns `true` if the newest published snapshot belongs to a step.
    pub(crate) fn has_published(&self, step: u64) -> bool {
        self.last.step == step
    }

    pub(crate) fn run_id(&self) -> u64 {
        self.run_id
    }

    /// Connections of living clients.
    pub(crate) fn connections(&self) -> Vec<ConnectionId> {
        self.owner.connections()
    }

    /// Logs the result of a command at the boundary before `step`.
    pub(crate) fn add_outcome(
        &mut self,
        step: u64,
        command: Command,
        result: Result<Applied, Reason>,
    ) {
        let outcome = Outcome::new(self.outcome_count, step, command, result.map(|_| ()));
        self.log(&outcome, 0);
        self.rejected_count += u64::from(result.is_err());
        if result == Ok(Applied::InPlace) {
            (self.since_step, self.in_place_step) = (step, step);
        }
        let is_same_state = result.is_err() || matches!(result, Ok(Applied::Control(_)));
        if is_same_state && self.same_state_count + 1 == self.outcome_count {
            self.same_state_count = self.outcome_count;
        }
        if result.is_ok_and(|applied| applied != Applied::Target) {
            self.request_keyframe();
        }
    }

    /// Logs a release that no client asked for, at the boundary before `step`.
    pub(crate) fn add_disconnection(&mut self, step: u64, release: Command) {
        let outcome = Outcome::new(self.outcome_count, step, release, Ok(()));
        self.log(&outcome, OUTCOME_FLAG_DISCONNECTED);
        self.request_keyframe();
    }

    /// Lets the next snapshot have a keyframe.
    fn request_keyframe(&mut self) {
        self.keyframes_due = self.keyframes_due.max(1);
    }

    fn log(&mut self, outcome: &Outcome, flags: u32) {
        self.outcomes.push(Outcome { run_id: self.run_id, flags, ..*outcome });
        self.outcome_count += 1;
    }

    /// Publishes everything that belongs to a step, the particles last, and wakes the readers.
    pub(crate) fn publish_step(
        &mut self,
        solver: &Solver,
        position: Position,
        times: StepTimes,
    ) -> anyhow::Result<()> {
        if position.step.is_multiple_of(u64::from(self.rate_hz)) {
            self.request_keyframe();
        }
        self.times = times;
        self.publish_colliders(solver, position.step)?;
        self.publish_tears(solver, position.step)?;
        let is_due = position.step.is_multiple_of(self.every) || position.is_last;
        if !is_due && !self.is_in_place(position.step) {
            return self.publish_outcomes();
        }
        self.publish_snapshot(solver, position)
    }

    /// Publishes the last step if it was left out, before commands change its state.
    pub(crate) fn publish_left_out(
        &mut self,
        solver: &Solver,
        position: Position,
    ) -> anyhow::Result<()> {
        if self.last.step == position.step {
            return Ok(());
        }
        self.publish_snapshot(solver, position)
    }

    fn publish_snapshot(&mut self, solver: &Solver, position: Position) -> anyhow::Result<()> {
        self.watch_keyframe_readers();
        if self.keyframes_due > 0 {
            self.publish_keyframe(solver, position)?;
            self.keyframes_due -= 1;
        }
        self.publish_outcomes()?;
        self.last = self.header(solver, position);
        self.same_state_count = self.outcome_count;
        let particles: &[ParticleState] = cast_slice(solver.particles());
        self.owner.publish_particles(&self.last, |index| particles[index])?;
        self.snapshot_count = self.snapshot_count.wrapping_add(1);
        self.phases.end(Phase::Publish);
        self.owner.wake(Wake::Frame);
        self.phases.end(Phase::Wake);
        Ok(())
    }

    /// Lets the solver compute the forces from the next step on if a client reads them.
    pub(crate) fn switch_forces(&mut self, solver: &mut Solver) {
        self.forces.switch(&self.owner, solver);
    }

    /// Publishes the forces of a step, if the solver has computed them. Call it before [`Self::publish_step`].
    pub(crate) fn publish_forces(&mut self, solver: &Solver, step: u64) -> Result<(), OwnerError> {
        let (run_id, rate_hz) = (self.run_id, self.rate_hz);
        let header = ForcesHeader { run_id, step, rate_hz, ..ForcesHeader::default() };
        self.forces.publish(&self.owner, header, solver)
    }

    /// Publishes the colliders if they differ from the last published ones.
    fn publish_colliders(&mut self, solver: &Solver, step: u64) -> anyhow::Result<()> {
        let states = || solver.colliders().map(|collider| to_collider_state(&collider));
        if states().eq(self.colliders.iter().copied()) {
            return Ok(());
        }
        self.colliders.clear();
        self.colliders.extend(states());
        let header = CollidersHeader { run_id: self.run_id, step, ..CollidersHeader::default() };
        self.owner.publish_colliders(header, &self.colliders)?;
        Ok(())
    }

    /// Publishes the list of all torn constraints if a constraint tore or was restored in this step. The constraints that
    /// tore are appended to the list; after a load, or a command that put a complete state in place, the list is made anew.
    fn publish_tears(&mut self, solver: &Solver, step: u64) -> anyhow::Result<()> {
        let (torn, new_count) = (solver.torn(), solver.new_torn_count());
        let is_continued = step != self.since_step;
        let is_same_list = torn.len() == self.torn.len() && is_continued;
        let are_none = torn.is_empty() && self.torn.is_empty();
        if new_count == 0 && (is_same_list || are_none) {
            return Ok(());
        }
        // The constraints before the new ones are in the published list.
        let kept_count = if is_continued { torn.len() - new_count } else { 0 };
        self.torn.truncate(kept_count);
        let pairs = torn.iter().zip(solver.tear_causes()).skip(self.torn.len());
        self.torn.extend(pairs.map(|(one, cause)| TornConstraint::new(*one, Some(*cause))));
        let header = TearsHeader {
            run_id: self.run_id,
            step,
            since_step: self.since_step,
            new_count: count(new_count),
            ..TearsHeader::default()
        };
        self.owner.publish_tears(header, &self.torn)?;
        self.owner.wake(Wake::Tears);
        Ok(())
    }

    /// Publishes the parameters if they differ from the parameters published last. `step` is the first
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
        self.parameters.clone_from(&values);
        Ok(self.owner.publish_parameters(self.run_id, step, &values)?)
    }

    /// Publishes outcomes while the node waits, and a keyframe of the last snapshot for a reader that
    /// has joined since. A command that has changed the waiting state makes that keyframe
    /// impossible; the reader then receives the keyframe of the next snapshot.
    ///
    /// A keyframe that exists is latched, so it is published again before outcomes that it does not count: a reader that
    /// joins later receives none of them.
    pub(crate) fn publish_between(
        &mut self,
        solver: &Solver,
        position: Position,
    ) -> anyhow::Result<()> {
        self.watch_keyframe_readers();
        let is_untouched =
            self.last.step == position.step && self.same_state_count == self.outcome_count;
        if is_untouched {
            if self.is_reader_waiting {
                self.keyframes_due = 0;
            }
            let exists = self.keyframe.step == position.step;
            let is_outdated = exists && self.keyframe.outcome_count != self.outcome_count;
            if is_outdated || (self.is_reader_waiting && !exists) {
                self.publish_keyframe(solver, position)?;
                self.owner.wake(Wake::Frame);
            }
            self.is_reader_waiting = false;
        }
        self.publish_outcomes()
    }

    pub(crate) fn publish_outcomes(&mut self) -> anyhow::Result<()> {
        if self.outcomes.is_empty() {
            return Ok(());
        }
        self.announce_outcomes()?;
        for outcome in self.outcomes.drain(..) {
            self.owner.publish_outcome(&outcome)?;
        }
        self.owner.wake(Wake::Outcome);
        Ok(())
    }

    /// Publishes the keyframe of the newest snapshot once more before outcomes that it does not count. A reader that
    /// joins later receives this snapshot and this keyframe, but not these outcomes.
    fn announce_outcomes(&mut self) -> anyhow::Result<()> {
        let Self { keyframe, outcome_count, last, .. } = self;
        let is_of_last = (keyframe.run_id, keyframe.step) == (last.run_id, last.step);
        let follow = keyframe.outcome_count < *outcome_count;
        if is_of_last && follow && keyframe.precedes_outcomes() {
            keyframe.published_outcome_count = *outcome_count;
            self.owner.publish_keyframe(*keyframe, &self.keyframe_bytes)?;
        }
        Ok(())
    }

    /// Makes keyframes due for a reader that has joined, so that its states begin at once. It joins the
    /// keyframes first and the particles last, and needs both of a step.
    fn watch_keyframe_readers(&mut self) {
        let (before, now) = (self.readers, self.reader_counts());
        self.is_reader_joining |= now.keyframe > before.keyframe;
        let has_joined = self.is_reader_joining && now.particles > before.particles;
        if now.keyframe > before.keyframe || has_joined {
            (self.keyframes_due, self.is_reader_waiting) = (2, true);
        }
        self.is_reader_joining &= !has_joined;
        self.readers = now;
    }

    fn reader_counts(&self) -> ReaderCounts {
        let keyframe = self.owner.keyframe_reader_count();
        ReaderCounts { keyframe, particles: self.owner.reader_count() }
    }

    fn publish_keyframe(&mut self, solver: &Solver, position: Position) -> anyhow::Result<()> {
        let mut keyframe = solver.keyframe();
        keyframe.paused = position.is_paused;
        self.keyframe_bytes = keyframe.encode();
        self.keyframe = KeyframeHeader {
            run_id: self.run_id,
            step: position.step,
            size_bytes: self.keyframe_bytes.len() as u64,
            outcome_count: self.outcome_count,
            published_outcome_count: self.outcome_count,
        };
        self.owner.publish_keyframe(self.keyframe, &self.keyframe_bytes)?;
        self.is_reader_waiting = false;
        Ok(())
    }

    fn header(&self, solver: &Solver, position: Position) -> SnapshotHeader {
        SnapshotHeader {
            contract_version: CONTRACT_VERSION,
            solver_version: SOLVER_VERSION,
            run_id: self.run_id,
            step: position.step,
            scene_step: solver.scene_step(),
            keyframe_step: self.keyframe.step,
            sim_time_ns: time_of_step_ns(position.step, self.rate_hz),
            publish_monotonic_ns: monotonic_ns(),
            state_hash: solver.state_hash(),
            outcome_count: self.outcome_count,
            wake_late_ns: self.times.wake_late_ns,
            solve_ns: self.times.solve_ns,
            topology_revision: self.topology_revision,
            torn_count: count(solver.torn().len()),
            particle_count: count(solver.particle_count()),
            flags: self.flags(position),
            stride: u32::try_from(self.every).unwrap_or(u32::MAX),
            snapshot_index: self.snapshot_count,
        }
    }

    fn flags(&self, position: Position) -> u32 {
        let paused = if position.is_paused { SnapshotFlags::PAUSED } else { 0 };
        let is_in_place = self.is_in_place(position.step);
        paused | if is_in_place { SnapshotFlags::IN_PLACE } else { 0 }
    }

    /// Same as [`Owner::start_wake_thread`].
    pub(crate) fn start_wake_thread(&mut self) -> anyhow::Result<()> {
        self.owner.start_wake_thread().context("no thread that wakes readers")
    }

    /// Gives late subscribers the latest message of each service that is seldom written.
    pub(crate) fn refresh(&self) {
        self.owner.refresh();
    }

    /// Same as [`Owner::missing_file`].
    pub(crate) fn missing_file(&self) -> Option<PathBuf> {
        self.owner.missing_file()
    }
}

/// Parameters of a solver with the time scale of the node.
fn parameter_values(solver: &Solver, time_scale: f64) -> ParameterValues {
    #[allow(clippy::cast_possible_truncation, reason = "it came from an f32")]
    let time_scale = time_scale as f32;
    solver.parameter_values().clone().with(Parameter::TimeScale, time_scale)
}

/// step / rate in nanoseconds, rounded down. Whole seconds apart from the rest, so that nothing
/// overflows.
fn time_of_step_ns(step: u64, rate_hz: u32) -> u64 {
    let rate_hz = u64::from(rate_hz);
    step / rate_hz * SECOND_NS + step % rate_hz * SECOND_NS / rate_hz
}

#[cfg(test)]
mod tests {
    //! The lists that steps publish, and the memory that they take.
    use std::time::Duration;

    use sim_contract::{Client, ScratchDomain};
    use sim_solver::ParameterValue;

    use super::*;

    /// A cloth that tears from its border on, beside a ball that moves.
    const SCENE: &str = "version = 1\n[solver]\ntear_force = 3\n[[generate]]\nshape = \"cloth\"\ncolumns = 12\n\
         rows = 12\nspacing = 0.05\nmass = 0.05\npinned = \"top\"\n[[collider]]\nshape = \"sphere\"\n\
         center = [0.3, -0.3, 0.5]\nradius = 0.2\nvelocity = [0, 0, -0.5]\n";

    /// The elements of a list, and where they are.
    fn memory<T>(list: &Vec<T>) -> (*const T, usize) {
        (list.as_ptr(), list.capacity())
    }

    fn pairs(solver: &Solver) -> Vec<TornConstraint> {
        let pairs = solver.torn().iter().zip(solver.tear_causes());
        pairs.map(|(one, cause)| TornConstraint::new(*one, Some(*cause))).collect()
    }

    #[test]
    fn steps_with_tears_and_moving_colliders_take_no_memory_and_publish_every_tear() {
        let domain = ScratchDomain::new("tears");
        let endpoint = domain.endpoint();
        let scene = Scene::from_toml(SCENE, "test").unwrap();
        let mut solver = Solver::new(&scene);
        let mut publisher = Publisher::new(&endpoint, &scene, &solver, 1).unwrap();
        let before = (memory(&publisher.torn), memory(&publisher.colliders));
        let (mut client, mut lists) = (Client::attach(&endpoint).unwrap(), 0);
        let mut step_on = |solver: &mut Solver, publisher: &mut Publisher, step: u64| {
            solver.step();
            let position = Position { step, is_paused: false, time_scale: 1.0, is_last: false };
            publisher.publish_step(solver, position, StepTimes::default()).unwrap();
            assert_eq!(publisher.is_in_place(step), step == 101);
            assert_eq!(publisher.has_published_in_place(step), step == 101);
            lists += u64::from(solver.new_torn_count() > 0);
            let torn = client.torn(Duration::from_secs(10)).unwrap();
            assert_eq!(torn.constraints, pairs(solver), "step {step}");
            assert_eq!(publisher.colliders.len(), 1);
        };
        for step in 1..=100 {
            step_on(&mut solver, &mut publisher, step);
        }
        assert!(solver.torn().len() > 100, "{} tore", solver.torn().len());
        // A reset empties the list, and others tear after it.
        solver.reset();
        publisher.add_outcome(101, Command::default(), Ok(Applied::InPlace));
        solver.set("tear_force", ParameterValue::Number(2.0), None).unwrap();
        step_on(&mut solver, &mut publisher, 101);
        // Another reset, before the next step, leaves the published one as it is.
        publisher.show_in_place(102);
        assert!(publisher.has_published_in_place(101) && !publisher.has_published_in_place(102));
        publisher.show_in_place(101);
        for step in 102..=150 {
            step_on(&mut solver, &mut publisher, step);
        }
        assert!(lists > 10, "{lists} steps with tears");
        assert_eq!((memory(&publisher.torn), memory(&publisher.colliders)), before);
    }
}
