//! Writes the states of a solver in the order in which a node publishes, with the events of particles that freeze.

use std::io::Write;

use sim_messages::{
    ColliderState, LoadHeader, Outcome, ParameterValues, ParticleFlags, ParticleState, PlainF32,
    Reason,
};
use sim_solver::{Applied, EnergyMeter, PlacedCollider, Scene, Solver};

use super::job::{Start, count};
use crate::log::{
    AnchorForceRow, Closing, ColliderForceRow, ColliderRow, CollidersRow, EventRow, ForcesRow,
    LogOptions, LogWriter, Message, OutcomeRow, ParametersRow, RunDescription, SceneColliders,
    StepRow, SurfaceRow, TearsRow, TopologyRow, WriteError,
};

/// Returns the memory that the recording of a simulation takes beside its solver, in bytes: for another solver of the scene as
/// loaded, and for rows and their encoded messages.
pub fn recording_bytes(scene: &Scene) -> u64 {
    scene.memory_bytes() + 3 * scene.published_bytes()
}

/// Starts the recording of a simulation.
///
/// # Errors
/// If it cannot be written.
pub fn begin_log<W: Write>(
    out: W,
    options: LogOptions,
    run: &RunDescription,
    scene: &Scene,
) -> Result<LogWriter<W>, WriteError> {
    let mut log = LogWriter::create(out, options, run, scene.to_toml().as_bytes(), 0)?;
    log.describe_colliders(&SceneColliders::new(scene))?;
    Ok(log)
}

/// Completes the recording of a simulation.
///
/// # Errors
/// If it cannot be written.
pub fn finish_log<W: Write>(log: LogWriter<W>, stop_reason: &str) -> Result<W, WriteError> {
    let (stop_reason, counts) = (stop_reason.to_owned(), *log.counts());
    let mut closing = Closing { stop_reason, counts, ..Closing::default() };
    closing.counts.set_received_to_written();
    log.finish(&closing)
}

/// Writes a simulation step by step. Every call gets the same log.
#[derive(Debug)]
pub(super) struct StateWriter {
    run: RunDescription,
    /// The outcomes of the next step.
    outcomes: Vec<OutcomeRow>,
    /// The next step has a keyframe, also if it is no whole simulated second.
    is_keyframe_due: bool,
    outcome_count: u64,
    first_step: u64,
    /// The colliders of the last step.
    colliders: Option<Vec<ColliderRow>>,
    /// The parameters of the last step.
    parameters: Option<ParameterValues>,
    frozen: FrozenTracker,
    /// None unless the recording has the energy of each state.
    meter: Option<EnergyMeter>,
}

impl StateWriter {
    /// Starts with the load. `solver` has the first state.
    pub(super) fn new<W: Write>(
        log: &mut LogWriter<W>,
        run: &RunDescription,
        scene: &Scene,
        start: Start,
        solver: &Solver,
    ) -> Result<Self, WriteError> {
        let header = LoadHeader { method: run.method, ..LoadHeader::default() };
        // A command may have changed the constraints of the state.
        let loaded = Solver::new(scene);
        let topology = TopologyRow::of_solver(&header, &loaded);
        let topology = TopologyRow { torn: solver.torn().to_vec(), ..topology };
        log.write(&Message::Topology(topology), 0)?;
        log.write(&Message::Surface(SurfaceRow::of_solver(&header, solver)), 0)?;
        Ok(Self {
            run: run.clone(),
            outcomes: Vec::new(),
            is_keyframe_due: true,
            outcome_count: start.outcome_count,
            first_step: start.step,
            // A scene without colliders has no row.
            colliders: Some(Vec::new()),
            parameters: None,
            frozen: FrozenTracker::default(),
            meter: log.selection().has_energy.then(|| EnergyMeter::of(solver)),
        })
    }

    /// Adds the outcome of a command at the boundary before the next step.
    pub(super) fn add_outcome(&mut self, outcome: &Outcome, result: Result<Applied, Reason>) {
        self.is_keyframe_due |= result.is_ok_and(|applied| applied != Applied::Target);
        self.outcomes.push(OutcomeRow::from(outcome));
    }

    /// Writes all messages of a step. The snapshot is the last one.
    pub(super) fn write_state<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        solver: &Solver,
        step: u64,
    ) -> Result<(), WriteError> {
        let time_ns = self.run.time_of_step_ns(step);
        let is_second = step.is_multiple_of(u64::from(self.run.rate_hz));
        // By simulated time, not by wall-clock time, so that equal inputs give equal files.
        if is_second && step > 0 {
            log.flush()?;
        }
        let is_in_place = self.outcomes.iter().any(|row| row.replaces_state() && row.is_applied());
        for row in self.outcomes.drain(..) {
            self.outcome_count += 1;
            log.write(&Message::Outcome(row), time_ns)?;
        }
        self.write_colliders(log, solver, step)?;
        if let Some(row) = new_tears_row(solver, step, is_in_place) {
            log.write(&Message::Tears(row), time_ns)?;
        }
        self.write_parameters(log, solver, step)?;
        // No step has led to the first state.
        if step > self.first_step
            && let Some(row) = forces_row(solver, step)
        {
            log.write(&Message::Forces(row), time_ns)?;
        }
        if std::mem::take(&mut self.is_keyframe_due) || is_second {
            let bytes = solver.keyframe().encode();
            log.write(&Message::Keyframe { step, bytes }, time_ns)?;
        }
        self.write_snapshot(log, solver, step)
    }

    /// Writes the colliders in each step while one moves, and after each change. The step after a
    /// motion is a change too, because the velocity returns to 0.
    fn write_colliders<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        solver: &Solver,
        step: u64,
    ) -> Result<(), WriteError> {
        let row = colliders_row(solver, step);
        if !changes(&mut self.colliders, &row.colliders) && !solver.has_moving_colliders() {
            return Ok(());
        }
        log.write(&Message::Colliders(row), self.run.time_of_step_ns(step))
    }

    /// Writes the parameters at the start and after each change.
    fn write_parameters<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        solver: &Solver,
        step: u64,
    ) -> Result<(), WriteError> {
        let values = solver.parameter_values();
        if !changes(&mut self.parameters, values) {
            return Ok(());
        }
        let row = ParametersRow { step, values: values.clone() };
        log.write(&Message::Parameters(row), self.run.time_of_step_ns(step))
    }

    fn write_snapshot<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        solver: &Solver,
        step: u64,
    ) -> Result<(), WriteError> {
        let time_ns = self.run.time_of_step_ns(step);
        let particles: &[ParticleState] = bytemuck::cast_slice(solver.particles());
        for row in self.frozen.new_events(step, FrozenParticles::find(particles)) {
            log.write(&Message::Event(row), time_ns)?;
        }
        let energy = self.meter.as_mut().map(|meter| meter.measure_solver(solver).into());
        let row = StepRow { outcome_count: self.outcome_count, energy, ..step_row(solver, step) };
        log.write(&Message::Step(row), time_ns)?;
        let mut buffer = log.take_spare().unwrap_or_default();
        buffer.copy_from(particles);
        log.write_particles(step, buffer, time_ns)
    }
}

/// Returns `true` if a value differs from the last one, which it replaces.
fn changes<T: Clone + PartialEq>(last: &mut Option<T>, now: &T) -> bool {
    let is_changed = last.as_ref() != Some(now);
    if is_changed {
        *last = Some(now.clone());
    }
    is_changed
}

/// Returns the row of `step`, of a recording of every step, without the number of outcomes.
pub fn step_row(solver: &Solver, step: u64) -> StepRow {
    StepRow {
        step,
        scene_step: solver.scene_step(),
        state_hash: solver.state_hash(),
        torn_count: count(solver.torn().len()),
        snapshot_index: low_32_bits(step),
        ..StepRow::default()
    }
}

#[allow(clippy::cast_possible_truncation, reason = "the low half is wanted")]
fn low_32_bits(step: u64) -> u32 {
    step as u32
}

/// Returns the colliders after `step`.
pub fn colliders_row(solver: &Solver, step: u64) -> CollidersRow {
    let states: Vec<_> = solver.colliders().map(|collider| state(&collider)).collect();
    // Every shape of this solver has a row.
    CollidersRow::new(step, &states).unwrap_or(CollidersRow { step, colliders: Vec::new() })
}

/// Returns the tears of the last step, which is `step`, or `None` without tears. All tears of a state that a command
/// put in place count as tears of that step.
pub(crate) fn new_tears_row(solver: &Solver, step: u64, is_in_place: bool) -> Option<TearsRow> {
    let count = if is_in_place { solver.torn().len() } else { solver.new_torn_count() };
    (count > 0).then(|| newest_tears_row(solver, step, count))
}

/// Returns the newest `count` torn constraints, or all if there are fewer.
pub(crate) fn newest_tears_row(solver: &Solver, step: u64, count: usize) -> TearsRow {
    let first = solver.torn().len().saturating_sub(count);
    let causes = solver.tear_causes()[first..].iter();
    TearsRow {
        step,
        constraints: solver.torn()[first..].to_vec(),
        causes: causes.map(|cause| cause.name().to_owned()).collect(),
    }
}

/// Returns a collider as a node publishes it.
fn state(collider: &PlacedCollider) -> ColliderState {
    let PlacedCollider { shape, restitution, friction, velocity, angular_velocity } = *collider;
    ColliderState { restitution, friction, velocity, angular_velocity, ..shape.fields().into() }
}

/// Returns the forces of the last step, which is `step`, if the solver computes them.
pub fn forces_row(solver: &Solver, step: u64) -> Option<ForcesRow> {
    let forces = solver.forces()?;
    let plain = |vector: [f32; 3]| vector.map(PlainF32);
    let colliders = forces.colliders.iter().map(|one| ColliderForceRow {
        impulse: plain(one.impulse.linear),
        angular_impulse: plain(one.impulse.angular),
        contacts: one.contacts,
    });
    let anchors = forces.anchors.iter().map(|one| AnchorForceRow {
        impulse: plain(one.linear),
        angular_impulse: plain(one.angular),
    });
    Some(ForcesRow {
        step,
        colliders: colliders.collect(),
        anchors: anchors.collect(),
        particles: forces.particles.iter().map(|one| one.particle).collect(),
        impulses: forces.particles.iter().map(|one| plain(one.impulse)).collect(),
    })
}

/// Most events of a step, so that a scene that diverges does not flood the file.
const EVENTS_PER_STEP_MAX: usize = 1024;

/// Particles whose flags are tested together, because frozen ones are rare: in half the time of one by one.
const TESTED_TOGETHER: usize = 64;

/// The frozen particles of a snapshot.
#[derive(Debug)]
pub struct FrozenParticles {
    /// Ascending.
    indices: Vec<u32>,
}

impl FrozenParticles {
    /// Finds the frozen particles.
    pub fn find(particles: &[ParticleState]) -> Self {
        let is_frozen = |flags: u32| flags & ParticleFlags::FROZEN != 0;
        let mut indices = Vec::new();
        for (first, some) in
            (0_u32..).step_by(TESTED_TOGETHER).zip(particles.chunks(TESTED_TOGETHER))
        {
            if is_frozen(some.iter().fold(0, |flags, state| flags | state.flags)) {
                let frozen = (first..).zip(some).filter(|(_, state)| is_frozen(state.flags));
                indices.extend(frozen.map(|(index, _)| index));
            }
        }
        Self { indices }
    }

    /// Returns `true` if this particle is frozen.
    fn contains(&self, index: u32) -> bool {
        self.indices.binary_search(&index).is_ok()
    }
}

/// Compares the frozen particles of each snapshot with those of the previous one.
#[derive(Debug, Default)]
pub struct FrozenTracker {
    /// Those of the last snapshot. `None` before the first snapshot.
    known: Option<FrozenParticles>,
}

impl FrozenTracker {
    /// Returns the events of a snapshot. The first snapshot has none, because its frozen particles
    /// froze earlier. After a reset a particle can freeze again.
    pub fn new_events(&mut self, step: u64, frozen: FrozenParticles) -> Vec<EventRow> {
        let newest = self.known.take();
        let known = self.known.insert(frozen);
        let Some(before) = newest else { return Vec::new() };
        let new = known.indices.iter().copied().filter(|index| !before.contains(*index));
        rows(step, &new.collect::<Vec<_>>())
    }
}

fn rows(step: u64, frozen: &[u32]) -> Vec<EventRow> {
    // Beyond the limit, the last event gives the number of particles without one.
    let is_over_limit = frozen.len() > EVENTS_PER_STEP_MAX;
    let named_count = if is_over_limit { EVENTS_PER_STEP_MAX - 1 } else { frozen.len() };
    let (named, others) = frozen.split_at(named_count);
    let mut rows: Vec<_> = named.iter().map(|index| frozen_event(step, *index)).collect();
    if is_over_limit {
        rows.push(row(step, None, format!("{} more particles are frozen", others.len())));
    }
    rows
}

/// Returns the event of one particle.
fn frozen_event(step: u64, particle: u32) -> EventRow {
    row(step, Some(particle), format!("particle {particle} was not finite and is frozen"))
}

fn row(step: u64, particle: Option<u32>, text: String) -> EventRow {
    EventRow { step, kind: "frozen".to_owned(), particle, client_id: None, text }
}

#[cfg(test)]
mod frozen_tests {
    use super::*;

    fn snapshot(frozen: &[usize], count: usize) -> Vec<ParticleState> {
        let flags = |index| if frozen.contains(&index) { ParticleFlags::FROZEN } else { 1 };
        let state = |index| ParticleState { flags: flags(index), ..ParticleState::default() };
        (0..count).map(state).collect()
    }

    fn particles(rows: &[EventRow]) -> Vec<Option<u32>> {
        rows.iter().map(|row| row.particle).collect()
    }

    #[test]
    fn every_frozen_particle_is_found() {
        for frozen in [vec![], vec![0], vec![63, 64], vec![1, 2, 130], (0..200).collect()] {
            let found = FrozenParticles::find(&snapshot(&frozen, 200)).indices;
            assert!(found.iter().map(|index| *index as usize).eq(frozen), "{found:?}");
        }
    }

    #[test]
    fn only_newly_frozen_particles_are_events() {
        let mut tracker = FrozenTracker::default();
        let mut events = |frozen: &[usize]| {
            particles(&tracker.new_events(3, FrozenParticles::find(&snapshot(frozen, 5))))
        };
        assert_eq!(events(&[2]), [], "it froze before the recording");
        assert_eq!(events(&[0, 2, 4]), [Some(0), Some(4)]);
        assert_eq!(events(&[0, 2, 4]), []);
        assert_eq!(events(&[]), [], "a reset");
        assert_eq!(events(&[2]), [Some(2)]);
    }

    #[test]
    fn the_last_event_of_a_step_over_the_limit_counts_the_remaining_particles() {
        for (count, named) in [(EVENTS_PER_STEP_MAX, 1024), (EVENTS_PER_STEP_MAX + 1, 1023)] {
            let mut tracker = FrozenTracker::default();
            tracker.new_events(0, FrozenParticles::find(&snapshot(&[], count)));
            let all: Vec<_> = (0..count).collect();
            let rows = tracker.new_events(1, FrozenParticles::find(&snapshot(&all, count)));
            assert_eq!(rows.len(), EVENTS_PER_STEP_MAX);
            assert_eq!(rows.iter().filter(|row| row.particle.is_some()).count(), named);
            if named == 1023 {
                assert_eq!(rows[named].text, "2 more particles are frozen");
            }
        }
    }
}
