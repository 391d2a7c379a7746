//! Re-simulates a recording and compares every recorded step, from the file alone.

use std::collections::VecDeque;
use std::sync::atomic::AtomicBool;

use crate::log::{EnergyRow, Frame, Message, OutcomeRow, RecordedState, StepRow, Topic};
use sim_messages::{Action, Outcome, ParticleState, RestoreContents};
use sim_solver::{Applied, Control, EnergyMeter, Keyframe, Scene, Solver};

use super::finding::{Difference, SnapshotFinding, StepGap, first_difference};
use super::past_states::PastStates;
use super::rows::{compare_row, ignore_collider_velocities, newest_rows};
use crate::simulation::apply;

/// The reason why a recording cannot be re-simulated.
#[derive(Debug, thiserror::Error)]
pub enum ResimulationError {
    /// The keyframe cannot be decoded.
    #[error("step {step}: the message on /keyframe: {cause}")]
    Keyframe {
        /// The step of the keyframe.
        step: u64,
        /// The error in the keyframe.
        cause: sim_solver::KeyframeError,
    },
    /// The solver refuses the state.
    #[error("step {step}: the state in /particles and /keyframe: {cause}")]
    State {
        /// The step of the state.
        step: u64,
        /// The reason of the solver.
        cause: sim_solver::RestoreError,
    },
}

/// The re-simulation of a recording.
#[derive(Debug)]
pub struct Resimulation {
    /// The scene at load, until the first state is compared, if that is step 0.
    loaded: Option<Solver>,
    solver: Solver,
    /// The step of the solver's state.
    step: u64,
    /// The step of the snapshot whose messages were added last.
    added_step: u64,
    /// The node was paused. The solver does not know it.
    is_paused: bool,
    /// Index of the next outcome to apply.
    next_index: u64,
    /// The messages of the next steps that were read, and apart from them the parameters.
    updates: VecDeque<Message>,
    parameters: VecDeque<Message>,
    past: PastStates,
    gaps: Vec<StepGap>,
    /// The last one has no end yet.
    is_in_gap: bool,
    /// Messages before the first state that do not describe it.
    earlier_count: usize,
    /// Measures the states, if the recording has their energy.
    meter: Option<EnergyMeter>,
}

impl Resimulation {
    /// Starts at a snapshot. Returns `None` if it has no keyframe.
    ///
    /// # Errors
    /// If the state is invalid.
    pub fn start(scene: &Scene, frame: &Frame) -> Result<Option<Self>, ResimulationError> {
        if !frame.is_complete_state() {
            return Ok(None);
        }
        Self::start_with(Solver::new(scene), frame).map(Some)
    }

    /// Starts at a complete state with a solver of its scene. At step 0 the solver must be the one that the
    /// scene makes at load.
    pub(super) fn start_with(mut solver: Solver, frame: &Frame) -> Result<Self, ResimulationError> {
        let step = frame.row.step;
        let bytes = frame.own_keyframe().unwrap_or_default();
        let keyframe =
            Keyframe::decode(bytes).map_err(|cause| ResimulationError::Keyframe { step, cause })?;
        let loaded = (step == 0).then(|| solver.clone());
        solver
            .restore(bytemuck::cast_slice(frame.payload()), &keyframe)
            .map_err(|cause| ResimulationError::State { step, cause })?;
        let next_index = frame.row.outcome_count;
        let past = PastStates::from_first(step, &solver);
        Ok(Self {
            loaded,
            solver,
            step,
            added_step: step,
            is_paused: keyframe.paused,
            next_index,
            updates: VecDeque::new(),
            parameters: VecDeque::new(),
            past,
            gaps: Vec::new(),
            is_in_gap: false,
            earlier_count: 0,
            meter: None,
        })
    }

    /// Returns the simulated states and the solver with the last one.
    pub(super) fn finish(self) -> (PastStates, Solver) {
        (self.past, self.solver)
    }

    /// Returns the last simulated step.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Returns the particles after that step.
    pub fn particles(&self) -> &[ParticleState] {
        bytemuck::cast_slice(self.solver.particles())
    }

    /// Returns the hash of the state after that step.
    pub fn state_hash(&self) -> u64 {
        self.solver.state_hash()
    }

    /// Returns the rest of the state after that step.
    pub fn keyframe(&self) -> Keyframe {
        let mut keyframe = self.solver.keyframe();
        keyframe.paused = self.is_paused;
        keyframe
    }

    /// Sets the number of threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.solver.set_threads(threads);
    }

    /// Compares the first snapshot with its own header and with the rows before it. Compares step 0 with
    /// the scene.
    pub fn compare_start(&mut self, frame: &Frame) -> SnapshotFinding {
        let loaded = self.loaded.take();
        let rows = newest_rows(frame);
        let is_of_state = |update: &&Message| update.topic().is_of_state();
        self.earlier_count = frame.updates.iter().filter(is_of_state).count() - rows.len();
        match self.compare_first(frame, rows, loaded.as_ref()) {
            SnapshotFinding::Identical => {
                self.compare_energy(&frame.row).unwrap_or(SnapshotFinding::Identical)
            }
            different => different,
        }
    }

    fn compare_first(
        &self,
        frame: &Frame,
        mut rows: Vec<Message>,
        loaded: Option<&Solver>,
    ) -> SnapshotFinding {
        let expected = loaded.unwrap_or(&self.solver);
        let finding = compare(expected, frame);
        if finding != SnapshotFinding::Identical {
            return finding;
        }
        if loaded.is_none() {
            ignore_collider_velocities(&mut rows, expected);
        }
        let what = match rows.iter().find_map(|row| compare_row(row, expected)) {
            None if has_other_tears(frame, expected) => Some(
                "its torn constraints in /topology and /tears differ from its keyframe".to_owned(),
            ),
            None if self.step == 0 && frame.row.outcome_count > 0 => {
                let count = frame.row.outcome_count;
                Some(format!("its row in /steps counts {count} outcomes before the first step"))
            }
            what => what,
        };
        what.map_or(SnapshotFinding::Identical, |what| SnapshotFinding::at_step(self.step, what))
    }

    /// Simulates up to the next snapshot and compares it, unless `stop` becomes true. After missing outcomes,
    /// goes on from the next complete state.
    pub fn advance(&mut self, frame: &Frame, stop: &AtomicBool) -> SnapshotFinding {
        let row = &frame.row;
        if row.step <= self.step {
            let what = format!("its row in /steps follows step {} in the file", self.step);
            return SnapshotFinding::at_step(row.step, what);
        }
        self.add_frame(frame);
        if self.is_in_gap {
            return self.go_on_from(frame);
        }
        let finding = self.simulate_to(frame, stop);
        if let SnapshotFinding::Incomplete { step, .. } = &finding {
            self.gaps.push(StepGap { from: *step, to: row.step });
            self.is_in_gap = true;
            let state = self.go_on_from(frame);
            if state != SnapshotFinding::NotCompared {
                return state;
            }
        }
        finding
    }

    /// Simulates up to a step before the next snapshot, and compares everything but particles.
    /// [`Self::advance`] with the same snapshot goes on from there.
    pub fn advance_to(&mut self, step: u64, frame: &Frame, stop: &AtomicBool) -> SnapshotFinding {
        self.add_frame(frame);
        let finding = self.find_gap(&frame.row);
        let finding = finding.or_else(|| self.simulate_steps(step, frame, stop));
        finding.unwrap_or(SnapshotFinding::Identical)
    }

    /// Simulates up to a step. In that of the snapshot, the particles are compared before the other rows.
    fn simulate_steps(
        &mut self,
        step: u64,
        frame: &Frame,
        stop: &AtomicBool,
    ) -> Option<SnapshotFinding> {
        while self.step < step {
            if let Some(finding) = self.simulate_step(frame, stop) {
                return Some(finding);
            }
            if self.step < frame.row.step
                && let Some(finding) = self.compare_rows()
            {
                return Some(finding);
            }
        }
        None
    }

    fn simulate_to(&mut self, frame: &Frame, stop: &AtomicBool) -> SnapshotFinding {
        let row = &frame.row;
        if let Some(finding) = self.find_gap(row) {
            return finding;
        }
        if let Some(finding) = self.simulate_steps(row.step, frame, stop) {
            return finding;
        }
        if self.next_index != row.outcome_count {
            let (recorded, simulated) = (row.outcome_count, self.next_index);
            let what = format!("/steps: outcome_count: recorded {recorded}, simulated {simulated}");
            return SnapshotFinding::at_step(row.step, what);
        }
        match compare(&self.solver, frame) {
            SnapshotFinding::Identical => self
                .compare_rows()
                .or_else(|| self.compare_energy(row))
                .unwrap_or(SnapshotFinding::Identical),
            // The torn constraints may differ. The rows name the first one.
            different @ SnapshotFinding::Diverged { difference: None, .. } => {
                self.compare_rows().unwrap_or(different)
            }
            different => different,
        }
    }

    /// Ends a gap if the snapshot is a complete state, which then replaces that of the simulation.
    fn go_on_from(&mut self, frame: &Frame) -> SnapshotFinding {
        let row = &frame.row;
        self.updates.clear();
        self.parameters.clear();
        if let Some(gap) = self.gaps.last_mut() {
            gap.to = row.step;
        }
        let Some(bytes) = frame.own_keyframe().filter(|_| frame.particles.is_some()) else {
            return SnapshotFinding::NotCompared;
        };
        let particles = bytemuck::cast_slice(frame.payload());
        let restored = Keyframe::decode(bytes)
            .map_err(|cause| ResimulationError::Keyframe { step: row.step, cause })
            .and_then(|keyframe| {
                let restored = self.solver.restore(particles, &keyframe);
                restored.map_err(|cause| ResimulationError::State { step: row.step, cause })
            });
        if let Err(error) = restored {
            return SnapshotFinding::at_step(row.step, error.to_string());
        }
        (self.step, self.next_index) = (row.step, row.outcome_count);
        self.past.restart(row.step, &self.solver);
        self.is_in_gap = false;
        match compare(&self.solver, frame) {
            SnapshotFinding::Identical => SnapshotFinding::NotCompared,
            different => different,
        }
    }

    /// Returns the steps whose states could not be simulated.
    pub(super) fn gaps(&self) -> &[StepGap] {
        &self.gaps
    }

    /// Removes the rows of the newest step, and compares them. Returns the first difference.
    fn compare_rows(&mut self) -> Option<SnapshotFinding> {
        let step = self.step;
        let mut has_topic = [false; Topic::ALL.len()];
        while let Some(row) = self.updates.pop_front_if(|row| row.step() <= step) {
            let topic = row.topic();
            let is_twice = std::mem::replace(&mut has_topic[topic.index()], true);
            let what = if is_twice {
                Some(format!("its message on {} is in the file twice", topic.name()))
            } else {
                compare_row(&row, &self.solver)
            };
            if let Some(what) = what {
                return Some(SnapshotFinding::at_step(step, what));
            }
        }
        let mut last = None;
        while let Some(row) = self.parameters.pop_front_if(|row| row.step() <= step) {
            let what = if last.as_ref() == Some(&row) {
                Some("its message on /parameters is in the file twice".to_owned())
            } else {
                compare_row(&row, &self.solver)
            };
            if let Some(what) = what {
                return Some(SnapshotFinding::at_step(step, what));
            }
            last = Some(row);
        }
        None
    }

    /// Compares the energy of a state with the recorded one, if there is one.
    fn compare_energy(&mut self, row: &StepRow) -> Option<SnapshotFinding> {
        let recorded = row.energy?;
        let meter = self.meter.get_or_insert_with(|| EnergyMeter::of(&self.solver));
        let simulated = EnergyRow::from(meter.measure_solver(&self.solver));
        (recorded != simulated).then(|| {
            let what = format!("/steps: energy: recorded {recorded:?}, simulated {simulated:?}");
            SnapshotFinding::at_step(row.step, what)
        })
    }

    /// Adds the messages before a snapshot that describe states, once.
    fn add_frame(&mut self, frame: &Frame) {
        if self.added_step >= frame.row.step {
            return;
        }
        self.added_step = frame.row.step;
        for update in frame.updates.iter().filter(|update| update.topic().is_of_state()) {
            match update {
                Message::Parameters(_) => self.parameters.push_back(update.clone()),
                _ => self.updates.push_back(update.clone()),
            }
        }
        let has_forces = self.updates.iter().any(|one| matches!(one, Message::Forces(_)));
        // The next steps have forces, too.
        if has_forces && self.solver.forces().is_none() {
            self.solver.compute_forces(true);
        }
    }

    /// Returns the number of messages before the first state that do not describe it.
    pub(super) fn earlier_count(&self) -> usize {
        self.earlier_count
    }

    /// Finds the first outcome that the snapshot counts and the log lacks.
    fn find_gap(&self, row: &StepRow) -> Option<SnapshotFinding> {
        let mut next = (self.next_index, self.step + 1);
        for update in &self.updates {
            let Message::Outcome(outcome) = update else { continue };
            if outcome.index != next.0 {
                break;
            }
            next = (outcome.index + 1, outcome.step);
        }
        let (index, step) = next;
        (index < row.outcome_count).then(|| {
            let what = format!(
                "/outcomes: outcome {index} is missing; /steps counts {} outcomes up to step {}",
                row.outcome_count, row.step
            );
            SnapshotFinding::Incomplete { step, what }
        })
    }

    /// Applies the outcomes of the next step in the order of their index, and computes the step. `frame` is
    /// that of the next snapshot.
    fn simulate_step(&mut self, frame: &Frame, stop: &AtomicBool) -> Option<SnapshotFinding> {
        let step = self.step + 1;
        let first_index = self.next_index;
        let is_due =
            |update: &mut Message| matches!(update, Message::Outcome(row) if row.step == step);
        while let Some(update) = self.updates.pop_front_if(is_due) {
            let Message::Outcome(row) = update else { continue };
            if row.index != self.next_index {
                let what = format!("/outcomes: outcome {} is misplaced, or there twice", row.index);
                return Some(SnapshotFinding::at_step(step, what));
            }
            self.next_index += 1;
            let is_in_place = row.puts_state_in_place() && row.is_applied();
            let finding =
                if is_in_place { self.put_in_place(&row, frame) } else { self.apply(&row) };
            if finding.is_some() {
                return finding;
            }
            self.pass_parameters();
        }
        if !self.solver.step_unless(stop) {
            return Some(SnapshotFinding::Interrupted);
        }
        self.step = step;
        self.past.add(&self.solver, self.next_index > first_index);
        None
    }

    /// Removes the oldest parameters if the solver has them between two commands of a step. A paused node publishes the
    /// parameters after each command.
    fn pass_parameters(&mut self) {
        if let (Some(first), Some(second)) = (self.parameters.front(), self.parameters.get(1))
            && first.step() == second.step()
            && first != second
            && compare_row(first, &self.solver).is_none()
        {
            self.parameters.pop_front();
        }
    }

    /// Puts the state of a snapshot in place, as the outcome of a rewind or restore says.
    fn put_in_place(&mut self, row: &OutcomeRow, frame: &Frame) -> Option<SnapshotFinding> {
        let (step, index) = (row.step, row.index);
        let is_state = frame.row.step == step && frame.particles.is_some();
        let keyframe = frame.own_keyframe().filter(|_| is_state);
        let Some(bytes) = keyframe else {
            let what = format!(
                "/outcomes: outcome {index} puts a state in place whose snapshot or keyframe is missing"
            );
            return Some(SnapshotFinding::Incomplete { step, what });
        };
        let result = self.put_state_in_place(row, frame.payload(), bytes);
        let problem = result.err().or_else(|| self.past.place(row, &self.solver));
        let what = format!("/outcomes: outcome {index}: {}", problem?);
        Some(SnapshotFinding::at_step(step, what))
    }

    fn put_state_in_place(
        &mut self,
        row: &OutcomeRow,
        particles: &[ParticleState],
        keyframe: &[u8],
    ) -> Result<(), String> {
        let particles = bytemuck::cast_slice(particles);
        let keeps_rest =
            matches!(row.action, Action::Restore { contents: RestoreContents::Motion, .. });
        if keeps_rest {
            self.solver.put_motion_in_place(particles).map_err(|error| error.to_string())
        } else {
            let keyframe = Keyframe::decode(keyframe).map_err(|error| error.to_string())?;
            self.solver.put_in_place(particles, &keyframe).map_err(|error| error.to_string())
        }
    }

    /// Applies an outcome and compares its status. Skips pause, resume and step, which control only the
    /// pace of the node, and rejected loads, rewinds and restores, which change nothing.
    fn apply(&mut self, row: &OutcomeRow) -> Option<SnapshotFinding> {
        let is_of_node = matches!(row.action, Action::Load { .. }) || row.puts_state_in_place();
        let is_rejected_by_node = is_of_node && !row.is_applied();
        let result = match apply(&mut self.solver, row.client_id, &row.action) {
            Ok(Applied::Control(control @ (Control::Pause | Control::Resume))) => {
                if row.is_applied() {
                    self.is_paused = matches!(control, Control::Pause);
                }
                return None;
            }
            Ok(Applied::Control(Control::Step { .. })) => return None,
            Err(_) if is_rejected_by_node => return None,
            result => result.map(|_| ()),
        };
        let again = Outcome::new(row.index, row.step, Outcome::from(row).command, result);
        let again = OutcomeRow::from(&again);
        if again.status == row.status && again.reason == row.reason {
            return None;
        }
        let what = format!(
            "/outcomes: outcome {}: recorded {} {}, simulated {} {}",
            row.index, row.status, row.reason, again.status, again.reason
        );
        Some(SnapshotFinding::Diverged { step: row.step, what, difference: None })
    }
}

/// Returns `true` if the torn constraints of the first snapshot differ from its rows. Later snapshots
/// have no `/topology`. An unknown cause equals any cause.
fn has_other_tears(frame: &Frame, solver: &Solver) -> bool {
    let torn = frame.updates.iter().find_map(|update| match update {
        Message::Topology(row) => Some(row.torn_before()),
        _ => None,
    });
    let Some(torn) = torn else { return false };
    let mut state = RecordedState { torn, ..RecordedState::default() };
    frame.updates.iter().for_each(|update| state.apply(update));
    let torn = state.torn;
    let expected = solver.torn().iter().zip(solver.tear_causes());
    torn.constraints.len() != solver.torn().len()
        || torn.constraints.iter().zip(expected).any(|(found, (index, cause))| {
            found.constraint != *index || found.cause().is_some_and(|found| found != *cause)
        })
}

/// Compares the recorded header, the recorded payload and the simulated state.
fn compare(solver: &Solver, frame: &Frame) -> SnapshotFinding {
    let row = &frame.row;
    let diverged =
        |what: String, difference| SnapshotFinding::Diverged { step: row.step, what, difference };
    let simulated_hash = solver.state_hash();
    if let Some(particles) = &frame.particles
        && let Some((what, difference)) = compare_particles(solver, particles)
    {
        return diverged(what, difference);
    }
    let counts = [
        ("scene_step", row.scene_step, solver.scene_step()),
        ("torn_count", u64::from(row.torn_count), solver.torn().len() as u64),
    ];
    let differs = |(_, recorded, simulated): &(_, u64, u64)| recorded != simulated;
    if let Some((name, recorded, simulated)) = counts.into_iter().find(differs) {
        return diverged(
            format!("/steps: {name}: recorded {recorded}, simulated {simulated}"),
            None,
        );
    }
    if row.state_hash != simulated_hash {
        let of =
            if frame.particles.is_some() { "its particles have" } else { "the simulation has" };
        let what = format!(
            "its row in /steps has the hash {:016x}, but {of} {simulated_hash:016x}",
            row.state_hash
        );
        return diverged(what, None);
    }
    SnapshotFinding::Identical
}

/// Describes the first difference of recorded particles from the simulated state.
fn compare_particles(
    solver: &Solver,
    recorded: &[ParticleState],
) -> Option<(String, Option<Difference>)> {
    let expected_count = solver.particle_count();
    if recorded.len() != expected_count {
        let count = recorded.len();
        let what = format!("/particles: recorded {count} particles, simulated {expected_count}");
        return Some((what, None));
    }
    let simulated = bytemuck::cast_slice(solver.particles());
    // One comparison of memory, because it runs for every step.
    if bytemuck::cast_slice::<_, u8>(recorded) == bytemuck::cast_slice::<_, u8>(simulated) {
        return None;
    }
    let difference = first_difference(recorded, simulated)?;
    Some((format!("/particles: {difference}"), Some(difference)))
}
