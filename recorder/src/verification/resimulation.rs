//! Re-simulates a recording and compares every recorded step, from the file alone.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use crate::log::{EnergyRow, Frame, Message, OutcomeRow, StepRow};
use sim_contract::{Action, Outcome, ParticleState, RestoreContents};
use sim_solver::{Applied, Control, EnergyMeter, Keyframe, Scene, Solver};

use super::finding::{SnapshotFinding, StepGap};
use super::past_states::PastStates;
use super::side_rows::SideRows;
use super::state::{compare, has_other_tears};
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
    /// Outcomes that were read but not applied yet, by index.
    pending: BTreeMap<u64, OutcomeRow>,
    side_rows: SideRows,
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
        Self::start_from(frame, || Solver::new(scene))
    }

    /// Starts at a snapshot with the solver of its scene at load, which `load` returns.
    pub(super) fn start_from(
        frame: &Frame,
        load: impl FnOnce() -> Solver,
    ) -> Result<Option<Self>, ResimulationError> {
        let step = frame.row.step;
        let Some(bytes) = frame.own_keyframe().filter(|_| frame.particles.is_some()) else {
            return Ok(None);
        };
        let keyframe =
            Keyframe::decode(bytes).map_err(|cause| ResimulationError::Keyframe { step, cause })?;
        let mut solver = load();
        let loaded = (step == 0).then(|| solver.clone());
        solver
            .restore(bytemuck::cast_slice(frame.payload()), &keyframe)
            .map_err(|cause| ResimulationError::State { step, cause })?;
        let next_index = frame.row.outcome_count;
        let past = PastStates::from_first(step, &solver);
        Ok(Some(Self {
            loaded,
            solver,
            step,
            added_step: step,
            is_paused: keyframe.paused,
            next_index,
            pending: BTreeMap::new(),
            side_rows: SideRows::after_start(step),
            past,
            gaps: Vec::new(),
            is_in_gap: false,
            earlier_count: 0,
            meter: None,
        }))
    }

    /// Returns the last simulated step.
    pub fn step(&self) -> u64 {
        self.step
    }

    /// Returns the particles after that step.
    pub fn particles(&self) -> &[ParticleState] {
        bytemuck::cast_slice(self.solver.particles())
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
        let mut rows = match SideRows::up_to_start(&frame.updates, self.step) {
            Ok(rows) => rows,
            Err(what) => return SnapshotFinding::at_step(self.step, what),
        };
        self.earlier_count += rows.keep_newest(self.step);
        let is_earlier = |update: &&Message| match update {
            // Outcomes with a lower index are part of the first state.
            Message::Outcome(row) => row.index < self.next_index,
            update => update.step() <= self.step,
        };
        let (earlier, later): (Vec<_>, Vec<_>) = frame.updates.iter().partition(is_earlier);
        let outcomes = earlier.iter().filter(|update| matches!(update, Message::Outcome(_)));
        self.earlier_count += outcomes.count();
        if let Some(finding) = self.add_updates(later) {
            return finding;
        }
        let loaded = self.loaded.take();
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
        mut rows: SideRows,
        loaded: Option<&Solver>,
    ) -> SnapshotFinding {
        let expected = loaded.unwrap_or(&self.solver);
        let finding = compare(expected, frame);
        if finding != SnapshotFinding::Identical {
            return finding;
        }
        if loaded.is_none() {
            rows.ignore_collider_velocities(expected);
        }
        let what = match rows.compare_all(expected) {
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
        if let Some(finding) = self.add_frame(frame) {
            return finding;
        }
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
        let finding = self.add_frame(frame).or_else(|| self.find_gap(&frame.row));
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
                && let Some(finding) = self.compare_side_rows()
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
        // All outcomes that the header counts are applied now, unless one has another step.
        if self.next_index > row.outcome_count {
            let (recorded, simulated) = (row.outcome_count, self.next_index);
            let what = format!("/steps: outcome_count: recorded {recorded}, simulated {simulated}");
            return SnapshotFinding::at_step(row.step, what);
        }
        if self.next_index != row.outcome_count {
            return self.misplaced(row.step, "its step is after the snapshot that counts it");
        }
        match compare(&self.solver, frame) {
            SnapshotFinding::Identical => self
                .compare_side_rows()
                .or_else(|| self.compare_energy(row))
                .unwrap_or(SnapshotFinding::Identical),
            // The torn constraints may differ. The rows name the first one.
            different @ SnapshotFinding::Diverged { difference: None, .. } => {
                self.compare_side_rows().unwrap_or(different)
            }
            different => different,
        }
    }

    /// Ends a gap if the snapshot is a complete state, which then replaces that of the simulation.
    fn go_on_from(&mut self, frame: &Frame) -> SnapshotFinding {
        let row = &frame.row;
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
        self.pending = self.pending.split_off(&row.outcome_count);
        self.side_rows.forget_to(row.step);
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

    fn compare_side_rows(&mut self) -> Option<SnapshotFinding> {
        let step = self.step;
        let what = self.side_rows.compare(&self.solver, step)?;
        Some(SnapshotFinding::at_step(step, what))
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

    /// Adds the messages before a snapshot, once.
    fn add_frame(&mut self, frame: &Frame) -> Option<SnapshotFinding> {
        if self.added_step >= frame.row.step {
            return None;
        }
        self.added_step = frame.row.step;
        self.add_updates(&frame.updates)
    }

    /// Adds messages that are compared with later steps. Returns a finding for one that the file has twice,
    /// or whose step is past.
    fn add_updates<'a>(
        &mut self,
        updates: impl IntoIterator<Item = &'a Message>,
    ) -> Option<SnapshotFinding> {
        updates.into_iter().find_map(|update| {
            let what = match update {
                Message::Outcome(row) => return self.add_outcome(row),
                Message::Forces(row) if row.step > self.step => {
                    self.compute_forces();
                    self.side_rows.add(update, &self.solver, self.step)
                }
                _ => self.side_rows.add(update, &self.solver, self.step),
            }?;
            Some(SnapshotFinding::at_step(update.step(), what))
        })
    }

    /// Computes the forces of the next steps, which the recording has.
    fn compute_forces(&mut self) {
        if self.solver.forces().is_none() {
            self.solver.compute_forces(true);
        }
    }

    fn add_outcome(&mut self, row: &OutcomeRow) -> Option<SnapshotFinding> {
        let (index, step) = (row.index, row.step);
        if index >= self.next_index && !self.pending.contains_key(&index) {
            self.pending.insert(index, row.clone());
            return None;
        }
        // The number of outcomes of the state after a gap is only that of its row.
        let state = self.gaps.last().filter(|gap| step > gap.to);
        Some(match state {
            Some(gap) => SnapshotFinding::at_step(
                gap.to,
                format!("its row in /steps counts outcome {index}, which belongs to step {step}"),
            ),
            None => SnapshotFinding::at_step(
                step,
                format!("/outcomes: outcome {index} is in the file twice"),
            ),
        })
    }

    /// Returns the number of messages that belong to steps after the last snapshot.
    pub(super) fn waiting_count(&self) -> usize {
        self.pending.len() + self.side_rows.count()
    }

    /// Returns the number of messages before the first state that do not describe it.
    pub(super) fn earlier_count(&self) -> usize {
        self.earlier_count
    }

    /// Finds the first outcome that the snapshot counts and the log lacks.
    fn find_gap(&self, row: &StepRow) -> Option<SnapshotFinding> {
        let present = self.pending.range(self.next_index..).map(|(index, _)| *index);
        let expected = self.next_index..row.outcome_count;
        let missing = expected.zip(present.map(Some).chain(std::iter::repeat(None)));
        let (index, _) = missing.into_iter().find(|(index, present)| *present != Some(*index))?;
        let before = index.checked_sub(1).and_then(|before| self.pending.get(&before));
        let step = before.map_or(self.step + 1, |before| before.step.max(self.step + 1));
        let what = format!(
            "/outcomes: outcome {index} is missing; /steps counts {} outcomes up to step {}",
            row.outcome_count, row.step
        );
        Some(SnapshotFinding::Incomplete { step, what })
    }

    /// Applies the outcomes of the next step in the order of their index, and computes the step. `frame` is
    /// that of the next snapshot.
    fn simulate_step(&mut self, frame: &Frame, stop: &AtomicBool) -> Option<SnapshotFinding> {
        let step = self.step + 1;
        let first_index = self.next_index;
        while let Some(entry) = self.pending.first_entry().filter(|entry| entry.get().step <= step)
        {
            let row = entry.remove();
            if row.index != self.next_index || row.step != step {
                return Some(self.misplaced(row.step, "the log has another order"));
            }
            self.next_index += 1;
            let is_in_place = row.puts_state_in_place() && row.is_applied();
            let finding =
                if is_in_place { self.put_in_place(&row, frame) } else { self.apply(&row) };
            if finding.is_some() {
                return finding;
            }
            self.side_rows.pass_parameters(&self.solver, step);
        }
        if !self.solver.step_unless(stop) {
            return Some(SnapshotFinding::Interrupted);
        }
        self.step = step;
        self.past.add(&self.solver, self.next_index > first_index);
        None
    }

    /// Returns the number of states that were taken from the file, and are no state that the simulation
    /// had computed.
    pub(super) fn given_count(&self) -> u64 {
        self.past.given_count
    }

    /// Puts the state of a snapshot in place, as the outcome of a rewind or restore says, and compares it
    /// with the states that the simulation has computed.
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
        let problem = result.err().or_else(|| self.past.compare(&row.action, &self.solver));
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

    fn misplaced(&self, step: u64, why: &str) -> SnapshotFinding {
        let what = format!("/outcomes: outcome {} is misplaced: {why}", self.next_index);
        SnapshotFinding::Diverged { step, what, difference: None }
    }
}
