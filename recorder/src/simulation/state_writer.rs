//! Writes the states of a solver in the order in which a node publishes.

use std::io::Write;

use crate::log::{
    CollidersRow, LogWriter, Message, OutcomeRow, ParametersRow, RunDescription, StepRow,
    SurfaceRow, TopologyRow, WriteError, bend_state, constraint_state,
};
use sim_contract::{LoadHeader, ParameterValues, ParticleState, Triangle};
use sim_solver::Solver;

use super::frozen::{FrozenParticles, FrozenTracker};
use super::job::{Job, count};
use super::solver_rows::{colliders_row, forces_row, new_tears_row};

/// The time of the next keyframe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KeyframeDue {
    /// In this step.
    Now,
    /// In this step, if it is a whole simulated second.
    OnTheSecond,
}

/// Writes a simulation step by step.
pub(super) struct StateWriter<'a, W: Write> {
    log: &'a mut LogWriter<W>,
    run: RunDescription,
    /// The outcomes of the next step.
    pub(super) outcomes: Vec<OutcomeRow>,
    outcome_count: u64,
    first_step: u64,
    /// The last written row.
    colliders: CollidersRow,
    /// The last written values.
    parameters: Option<ParameterValues>,
    frozen: FrozenTracker,
}

impl<'a, W: Write> StateWriter<'a, W> {
    /// Starts with the load. `solver` has the first state.
    pub(super) fn new(
        log: &'a mut LogWriter<W>,
        run: RunDescription,
        job: &Job,
        solver: &Solver,
    ) -> Result<Self, WriteError> {
        let header = LoadHeader { method: run.method, ..LoadHeader::default() };
        // A command may have changed the constraints of the state.
        let loaded = Solver::new(&job.scene);
        let constraints: Vec<_> = loaded.constraints().map(constraint_state).collect();
        let triangles: Vec<_> =
            solver.triangles().iter().map(|corners| Triangle { corners: *corners }).collect();
        let bends: Vec<_> = loaded.bends().map(bend_state).collect();
        let topology = TopologyRow::new(&header, &constraints, &bends);
        let topology = TopologyRow { torn: solver.torn().to_vec(), ..topology };
        log.write(&Message::Topology(topology), 0)?;
        log.write(&Message::Surface(SurfaceRow::new(&header, &triangles)), 0)?;
        Ok(Self {
            log,
            run,
            outcomes: Vec::new(),
            outcome_count: job.start.outcome_count,
            first_step: job.start.step,
            // A scene without colliders has no row.
            colliders: CollidersRow { step: 0, colliders: Vec::new() },
            parameters: None,
            frozen: FrozenTracker::default(),
        })
    }

    /// Writes all messages of a step. The snapshot is the last one.
    pub(super) fn write_state(
        &mut self,
        solver: &Solver,
        step: u64,
        keyframe: KeyframeDue,
    ) -> Result<(), WriteError> {
        let time_ns = self.run.time_of_step_ns(step);
        let is_second = step.is_multiple_of(u64::from(self.run.rate_hz));
        // By simulated time, not by wall-clock time, so that equal inputs give equal files.
        if is_second && step > 0 {
            self.log.flush()?;
        }
        self.write_colliders(solver, step)?;
        let is_in_place = self.outcomes.iter().any(|row| row.replaces_state() && row.is_applied());
        if let Some(row) = new_tears_row(solver, step, is_in_place) {
            self.log.write(&Message::Tears(row), time_ns)?;
        }
        self.write_parameters(solver, step)?;
        // No step has led to the first state.
        if step > self.first_step
            && let Some(row) = forces_row(solver, step)
        {
            self.log.write(&Message::Forces(row), time_ns)?;
        }
        if is_second || keyframe == KeyframeDue::Now {
            let bytes = solver.keyframe().encode();
            self.log.write(&Message::Keyframe { step, bytes }, time_ns)?;
        }
        for row in self.outcomes.drain(..) {
            self.outcome_count += 1;
            self.log.write(&Message::Outcome(row), time_ns)?;
        }
        self.write_snapshot(solver, step)
    }

    /// Writes the colliders in each step while one moves, and after each change. The step after a
    /// motion is a change too, because the velocity returns to 0.
    fn write_colliders(&mut self, solver: &Solver, step: u64) -> Result<(), WriteError> {
        if solver.collider_count() == 0 {
            return Ok(());
        }
        let row = colliders_row(solver, step);
        if !solver.has_moving_colliders() && row.colliders == self.colliders.colliders {
            return Ok(());
        }
        self.colliders = row.clone();
        self.log.write(&Message::Colliders(row), self.run.time_of_step_ns(step))
    }

    /// Writes the parameters at the start and after each change.
    fn write_parameters(&mut self, solver: &Solver, step: u64) -> Result<(), WriteError> {
        let values = solver.parameter_values();
        if self.parameters.as_ref() == Some(&values) {
            return Ok(());
        }
        self.parameters = Some(values.clone());
        let row = ParametersRow { step, values };
        self.log.write(&Message::Parameters(row), self.run.time_of_step_ns(step))
    }

    fn write_snapshot(&mut self, solver: &Solver, step: u64) -> Result<(), WriteError> {
        let time_ns = self.run.time_of_step_ns(step);
        let particles: &[ParticleState] = bytemuck::cast_slice(solver.particles());
        for row in self.frozen.new_events(step, FrozenParticles::find(particles)) {
            self.log.write(&Message::Event(row), time_ns)?;
        }
        self.log.write(&Message::Step(self.row(solver, step)), time_ns)?;
        let mut buffer = self.log.take_spare().unwrap_or_default();
        buffer.copy_from(particles);
        self.log.write_particles(step, buffer, time_ns)
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
            // Every step is recorded.
            snapshot_index: Some(low_32_bits(step)),
        }
    }
}

#[allow(clippy::cast_possible_truncation, reason = "the low half is wanted")]
fn low_32_bits(step: u64) -> u32 {
    step as u32
}
