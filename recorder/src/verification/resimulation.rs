//! Re-simulates a recording and compares every recorded step, from the file alone.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use crate::log::{Frame, Message, OutcomeRow, StepRow, TearTracker};
use sim_contract::{Action, Outcome, ParticleState, RestoreContents};
use sim_solver::{Applied, Control, Keyframe, Scene, Solver};

use super::difference::{Difference, first_difference};
use super::finding::{SnapshotFinding, StepGap};
use super::past_states::PastStates;
use super::side_rows::SideRows;
use crate::simulation::apply::apply;

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
    scene: Scene,
    solver: Solver,
    /// The step of the solver's state.
    step: u64,
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
}

impl Resimulation {
    /// Starts at a snapshot. Returns `None` if it has no keyframe.
    ///
    /// # Errors
    /// If the state is invalid.
    pub fn start(scene: &Scene, frame: &Frame) -> Result<Option<Self>, ResimulationError> {
        let step = frame.row.step;
        let Some(bytes) = frame.own_keyframe().filter(|_| frame.particles.is_some()) else {
            return Ok(None);
        };
        let keyframe =
            Keyframe::decode(bytes).map_err(|cause| ResimulationError::Keyframe { step, cause })?;
        let mut solver = Solver::new(scene);
        solver
            .restore(bytemuck::cast_slice(frame.payload()), &keyframe)
            .map_err(|cause| ResimulationError::State { step, cause })?;
        let next_index = frame.row.outcome_count;
        let past = PastStates::from_first(step, &solver);
        Ok(Some(Self {
            scene: scene.clone(),
            solver,
            step,
            next_index,
            pending: BTreeMap::new(),
            side_rows: SideRows::after_start(step),
            past,
            gaps: Vec::new(),
            is_in_gap: false,
            earlier_count: 0,
        }))
    }

    /// Returns the particles of the last compared snapshot.
    pub fn particles(&self) -> &[ParticleState] {
        bytemuck::cast_slice(self.solver.particles())
    }

    /// Returns the keyframe of the last compared snapshot.
    pub fn keyframe(&self) -> Keyframe {
        self.solver.keyframe()
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
        self.compare_first(frame, rows)
    }

    fn compare_first(&self, frame: &Frame, mut rows: SideRows) -> SnapshotFinding {
        let scene_state = (self.step == 0).then(|| Solver::new(&self.scene));
        let expected = scene_state.as_ref().unwrap_or(&self.solver);
        let finding = compare(expected, frame);
        if finding != SnapshotFinding::Identical {
            return finding;
        }
        if scene_state.is_none() {
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
        if let Some(finding) = self.add_updates(&frame.updates) {
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

    fn simulate_to(&mut self, frame: &Frame, stop: &AtomicBool) -> SnapshotFinding {
        let row = &frame.row;
        if let Some(finding) = self.find_gap(row) {
            return finding;
        }
        while self.step < row.step {
            if let Some(finding) = self.simulate_step(frame, stop) {
                return finding;
            }
            // In the step of the snapshot, the particles are compared first.
            if self.step < row.step
                && let Some(finding) = self.compare_side_rows()
            {
                return finding;
            }
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
            SnapshotFinding::Identical => {
                self.compare_side_rows().unwrap_or(SnapshotFinding::Identical)
            }
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

    /// Adds messages that are compared with later steps. Returns a finding for one that the file has twice,
    /// or whose step is past.
    fn add_updates<'a>(
        &mut self,
        updates: impl IntoIterator<Item = &'a Message>,
    ) -> Option<SnapshotFinding> {
        updates.into_iter().find_map(|update| {
            let what = match update {
                Message::Outcome(row) => return self.add_outcome(row),
                _ => self.side_rows.add(update, &self.solver, self.step),
            }?;
            Some(SnapshotFinding::at_step(update.step(), what))
        })
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
            Ok(Applied::Control(Control::Pause | Control::Resume | Control::Step { .. })) => {
                return None;
            }
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

/// Returns `true` if the torn constraints of the first snapshot differ from its rows. Later snapshots
/// have no `/topology`. An unknown cause equals any cause.
fn has_other_tears(frame: &Frame, solver: &Solver) -> bool {
    let torn = frame.updates.iter().find_map(|update| match update {
        Message::Topology(row) => Some(row.torn_before()),
        _ => None,
    });
    let Some(torn) = torn else { return false };
    let mut tracker = TearTracker::new(torn);
    frame.updates.iter().for_each(|update| tracker.process(update));
    let Some(torn) = tracker.at(frame.row.step) else { return false };
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
