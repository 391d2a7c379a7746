//! Simulates a recording again and compares every recorded step, from the file alone.

mod side_rows;

use std::collections::BTreeMap;

use recorder::{Frame, Message, OutcomeRow, StepRow, state_hash};
use sim_contract::{Action, Outcome, ParticleState};
use sim_solver::{Applied, Control, Keyframe, Scene, Solver};

use crate::apply::apply;
use crate::difference::{Difference, first_difference};
use side_rows::SideRows;

/// What the comparison of one snapshot found. The texts are for people.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// Every bit is as recorded.
    Identical,
    /// The same commands do not lead to what is recorded.
    Diverged {
        /// The first step that differs.
        step: u64,
        what: String,
        difference: Option<Difference>,
    },
    /// The log lacks outcomes: whether the solver agrees cannot be said.
    Incomplete {
        /// The first step that may lack one.
        step: u64,
        what: String,
    },
}

/// Why a recording cannot be simulated again.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StartError {
    #[error("the keyframe of step {step}: {cause}")]
    Keyframe { step: u64, cause: sim_solver::KeyframeError },
    #[error("the state of step {step}: {cause}")]
    State { step: u64, cause: sim_solver::RestoreError },
}

/// A recording that is being simulated again.
#[derive(Debug)]
pub(crate) struct Resimulation {
    scene: Scene,
    solver: Solver,
    /// The step that the solver is at.
    step: u64,
    /// Index of the next outcome to apply.
    next_index: u64,
    /// Outcomes that have been read and not applied, by index.
    waiting: BTreeMap<u64, OutcomeRow>,
    side_rows: SideRows,
}

impl Resimulation {
    /// Starts at a snapshot that has its keyframe; `None` if it has none.
    pub(crate) fn start(scene: &Scene, frame: &Frame) -> Result<Option<Self>, StartError> {
        let step = frame.row.step;
        let Some(bytes) = frame.own_keyframe() else { return Ok(None) };
        let keyframe =
            Keyframe::decode(bytes).map_err(|cause| StartError::Keyframe { step, cause })?;
        let mut solver = Solver::new(scene);
        solver
            .restore(bytemuck::cast_slice(&frame.particles), &keyframe)
            .map_err(|cause| StartError::State { step, cause })?;
        let next_index = frame.row.outcome_count;
        let mut start = Self {
            scene: scene.clone(),
            solver,
            step,
            next_index,
            waiting: BTreeMap::new(),
            side_rows: SideRows::default(),
        };
        start.take_updates(frame);
        Ok(Some(start))
    }

    /// Simulates with so many threads from now on.
    pub(crate) fn set_threads(&mut self, threads: usize) {
        self.solver.set_threads(threads);
    }

    /// Compares the snapshot that it started from with its own header and with what the file says
    /// was torn until then, and step 0 with the scene.
    pub(crate) fn compare_start(&self, frame: &Frame) -> Finding {
        let found = match self.step {
            0 => compare(&Solver::new(&self.scene), frame),
            _ => compare(&self.solver, frame),
        };
        let is_other = torn_until(frame).is_some_and(|torn| torn != self.solver.torn());
        if found != Finding::Identical || !is_other {
            return found;
        }
        let what = "/topology and /tears have other torn constraints than its keyframe".to_owned();
        Finding::Diverged { step: self.step, what, difference: None }
    }

    /// Steps to the next snapshot and compares it.
    pub(crate) fn advance(&mut self, frame: &Frame) -> Finding {
        self.take_updates(frame);
        let row = &frame.row;
        if row.step <= self.step {
            let what = format!("it follows step {} in the file", self.step);
            return Finding::Diverged { step: row.step, what, difference: None };
        }
        if let Some(finding) = self.find_gap(row) {
            return finding;
        }
        while self.step < row.step {
            if let Some(finding) = self.make_step() {
                return finding;
            }
            // Of the snapshot's own step, a particle says more than the rows beside it.
            if self.step < row.step
                && let Some(finding) = self.compare_side_rows()
            {
                return finding;
            }
        }
        // Whatever the header counts has been applied, or its step is another one.
        if self.next_index != row.outcome_count {
            return self.misplaced(row.step, "its step is not one of those it counts for");
        }
        match compare(&self.solver, frame) {
            Finding::Identical => {
                self.compare_side_rows().unwrap_or_else(|| self.compare_keyframe(frame))
            }
            // Other torn constraints, for one: these rows say which.
            different @ Finding::Diverged { difference: None, .. } => {
                self.compare_side_rows().unwrap_or(different)
            }
            different => different,
        }
    }

    /// What particles lack must be as recorded, too, where it is recorded.
    fn compare_keyframe(&self, frame: &Frame) -> Finding {
        let step = frame.row.step;
        let recorded = frame.own_keyframe().map(Keyframe::decode);
        let mut simulated = self.solver.keyframe();
        let what = match recorded {
            None => return Finding::Identical,
            Some(Err(error)) => format!("its keyframe is damaged: {error}"),
            Some(Ok(recorded)) => {
                // Whether the node was paused is not the solver's.
                simulated.paused = recorded.paused;
                if recorded == simulated {
                    return Finding::Identical;
                }
                "its keyframe is of another state: other masses, grabs, parameters or torn \
                 constraints, or other moved anchors or colliders"
                    .to_owned()
            }
        };
        Finding::Diverged { step, what, difference: None }
    }

    fn compare_side_rows(&mut self) -> Option<Finding> {
        let step = self.step;
        let what = self.side_rows.compare(&self.solver, step)?;
        Some(Finding::Diverged { step, what, difference: None })
    }

    fn take_updates(&mut self, frame: &Frame) {
        // What is of the state that this started from has been restored, not simulated.
        self.side_rows.take(&frame.updates, self.step + 1);
        let outcomes = frame.updates.iter().filter_map(|update| match update {
            // Those below are part of the state that this started from.
            Message::Outcome(row) if row.index >= self.next_index => Some(row),
            _ => None,
        });
        self.waiting.extend(outcomes.map(|row| (row.index, row.clone())));
    }

    /// Every outcome that is part of the snapshot must be in the log.
    fn find_gap(&self, row: &StepRow) -> Option<Finding> {
        let present = self.waiting.range(self.next_index..).map(|(index, _)| *index);
        let expected = self.next_index..row.outcome_count;
        let missing = expected.zip(present.map(Some).chain(std::iter::repeat(None)));
        let (index, _) = missing.into_iter().find(|(index, found)| *found != Some(*index))?;
        let before = index.checked_sub(1).and_then(|before| self.waiting.get(&before));
        let step = before.map_or(self.step + 1, |before| before.step.max(self.step + 1));
        let what = format!(
            "outcome {index} is missing; the snapshot of step {} counts {} outcomes",
            row.step, row.outcome_count
        );
        Some(Finding::Incomplete { step, what })
    }

    /// Applies the outcomes of the next step, in the order of their index, and makes it.
    fn make_step(&mut self) -> Option<Finding> {
        let step = self.step + 1;
        while let Some(entry) = self.waiting.first_entry().filter(|entry| entry.get().step <= step)
        {
            let row = entry.remove();
            if row.index != self.next_index || row.step != step {
                return Some(self.misplaced(row.step, "the order of the log is another one"));
            }
            self.next_index += 1;
            if let Some(finding) = self.apply(&row) {
                return Some(finding);
            }
        }
        self.solver.step();
        self.step = step;
        None
    }

    /// Pause, resume and step say when steps were made, and a refused load changes nothing; whether
    /// and why a node took them or not is not repeated.
    fn apply(&mut self, row: &OutcomeRow) -> Option<Finding> {
        let is_refused_load = matches!(row.action, Action::Load { .. }) && !row.is_applied();
        let result = match apply(&mut self.solver, row.client_id, &row.action) {
            Ok(Applied::Control(Control::Pause | Control::Resume | Control::Step { .. })) => {
                return None;
            }
            Err(_) if is_refused_load => return None,
            result => result.map(|_| ()),
        };
        let again = Outcome::new(row.index, row.step, Outcome::from(row).command, result);
        let again = OutcomeRow::from(&again);
        if again.status == row.status && again.reason == row.reason {
            return None;
        }
        let what = format!(
            "outcome {}: recorded {} {}, simulated {} {}",
            row.index, row.status, row.reason, again.status, again.reason
        );
        Some(Finding::Diverged { step: row.step, what, difference: None })
    }

    fn misplaced(&self, step: u64, why: &str) -> Finding {
        let what = format!("outcome {} is not where it belongs: {why}", self.next_index);
        Finding::Diverged { step, what, difference: None }
    }
}

/// What was torn at the first snapshot of a file, as its rows say; `None` of a later snapshot.
fn torn_until(frame: &Frame) -> Option<Vec<u32>> {
    let mut updates = frame.updates.iter();
    let mut torn = updates.find_map(|update| match update {
        Message::Topology(row) => Some(row.torn.clone()),
        _ => None,
    })?;
    for update in updates {
        if let Message::Tears(row) = update {
            torn.extend(&row.constraints);
        }
    }
    Some(torn)
}

/// The recorded header, the recorded payload and the simulated state must be one.
fn compare(solver: &Solver, frame: &Frame) -> Finding {
    let Frame { row, particles, .. } = frame;
    let diverged =
        |what: String, difference| Finding::Diverged { step: row.step, what, difference };
    let expected_count = solver.particle_count();
    if particles.len() != expected_count {
        let what = format!("recorded {} particles, simulated {expected_count}", particles.len());
        return diverged(what, None);
    }
    let simulated_hash = solver.state_hash();
    if state_hash(particles, solver.torn()) != simulated_hash {
        let simulated: Vec<ParticleState> =
            (0..expected_count).map(|index| bytemuck::cast(solver.particle(index))).collect();
        let difference = first_difference(particles, &simulated);
        let what = difference.as_ref().map_or_else(
            || "the recorded hash is of other torn constraints".to_owned(),
            ToString::to_string,
        );
        return diverged(what, difference);
    }
    let counts = [
        ("scene_step", row.scene_step, solver.scene_step()),
        ("torn_count", u64::from(row.torn_count), solver.torn().len() as u64),
    ];
    let is_other = |(_, recorded, simulated): &(_, u64, u64)| recorded != simulated;
    if let Some((name, recorded, simulated)) = counts.into_iter().find(is_other) {
        return diverged(format!("{name}: recorded {recorded}, simulated {simulated}"), None);
    }
    if row.state_hash != simulated_hash {
        let what = format!(
            "its row in /steps has the hash {:016x}, its particles have {simulated_hash:016x}",
            row.state_hash
        );
        return diverged(what, None);
    }
    Finding::Identical
}
