//! Digests of simulated states, to prove those that a command puts in place again.

use sim_messages::Action;
use sim_solver::Solver;
use xxhash_rust::xxh3::xxh3_64;

use super::finding::SnapshotFinding;
use crate::log::OutcomeRow;

/// The states that a re-simulation has computed, and those that commands have put in place.
#[derive(Debug)]
pub(super) struct PastStates {
    spans: Vec<StateSpan>,
    placed: Vec<Placed>,
    /// The rest of the newest state.
    rest: Rest,
}

/// Digests of consecutive states. 8 bytes each: a day at 240 Hz takes 166 MB.
#[derive(Debug)]
struct StateSpan {
    first_step: u64,
    digests: Vec<u64>,
}

impl StateSpan {
    fn at(&self, step: u64) -> Option<u64> {
        let place = usize::try_from(step.checked_sub(self.first_step)?).ok()?;
        self.digests.get(place).copied()
    }
}

/// A state that a command has put in place.
#[derive(Debug)]
struct Placed {
    step: u64,
    outcome_index: u64,
    /// The step of a rewind; `None` for a given state.
    to_step: Option<u64>,
    digest: u64,
}

impl PastStates {
    /// Starts with the first state.
    pub(super) fn from_first(first_step: u64, solver: &Solver) -> Self {
        let mut past = Self { spans: Vec::new(), placed: Vec::new(), rest: Rest::new(solver) };
        past.restart(first_step, solver);
        past
    }

    /// Goes on with a state that was taken from the file.
    pub(super) fn restart(&mut self, first_step: u64, solver: &Solver) {
        self.rest = Rest::new(solver);
        let digests = vec![self.rest.state_digest(solver, solver.state_hash())];
        self.spans.push(StateSpan { first_step, digests });
    }

    /// Adds the state after the next step. `is_commanded` is true if commands precede the step.
    pub(super) fn add(&mut self, solver: &Solver, is_commanded: bool) {
        if is_commanded || !self.rest.is_same(solver) {
            self.rest = Rest::new(solver);
        }
        let digest = self.rest.state_digest(solver, solver.state_hash());
        if let Some(span) = self.spans.last_mut() {
            span.digests.push(digest);
        }
    }

    /// Compares a state that an outcome has put in place with the computed ones, or keeps it for [`AllStates`]. Returns a
    /// description of a difference.
    pub(super) fn place(&mut self, row: &OutcomeRow, solver: &Solver) -> Option<String> {
        let state_hash = solver.hash_in_place();
        let to_step = match row.action {
            Action::Rewind { to_step: Some(to_step), back_steps: None } if to_step < row.step => {
                Some(to_step)
            }
            Action::Rewind { to_step: Some(to_step), back_steps: None } => {
                return Some(format!("it goes back to step {to_step}, which is later"));
            }
            Action::Restore { state_hash: recorded, .. } if recorded != state_hash => {
                return Some(format!(
                    "state_hash: recorded {recorded:016x}, but the state in place has {state_hash:016x}"
                ));
            }
            Action::Restore { .. } => None,
            _ => return Some("it does not name the step of the state".to_owned()),
        };
        let digest = Rest::new(solver).state_digest(solver, state_hash);
        if let Some(to_step) = to_step
            && let Some(known) = self.spans.iter().rev().find_map(|span| span.at(to_step))
        {
            let what = || format!("the state in place is not that of step {to_step}");
            return (known != digest).then(what);
        }
        let (step, outcome_index) = (row.step, row.index);
        self.placed.push(Placed { step, outcome_index, to_step, digest });
        None
    }
}

/// The states of the parts of a recording, in order.
#[derive(Debug, Default)]
pub(super) struct AllStates {
    spans: Vec<StateSpan>,
    /// Number of states that were put in place, and that no part has computed before.
    pub(super) given_count: u64,
}

impl AllStates {
    /// Adds the states of the next part. Returns the finding for the first state that a command has put in place and that
    /// is not the one of its step.
    pub(super) fn add(&mut self, past: PastStates) -> Option<SnapshotFinding> {
        self.spans.extend(past.spans);
        past.placed.iter().find_map(|placed| self.compare(placed))
    }

    fn compare(&mut self, placed: &Placed) -> Option<SnapshotFinding> {
        let known = match placed.to_step {
            Some(to_step) => self.spans.iter().rev().find_map(|span| span.at(to_step)),
            None => self.earlier(placed.step).find(|digest| *digest == placed.digest),
        };
        match (known, placed.to_step) {
            (Some(known), Some(to_step)) if known != placed.digest => {
                let index = placed.outcome_index;
                let what = format!(
                    "/outcomes: outcome {index}: the state in place is not that of step {to_step}"
                );
                Some(SnapshotFinding::at_step(placed.step, what))
            }
            (known, _) => {
                self.given_count += u64::from(known.is_none());
                None
            }
        }
    }

    /// Returns the digests of the states before a step.
    fn earlier(&self, step: u64) -> impl Iterator<Item = u64> {
        self.spans.iter().flat_map(move |span| {
            let steps = span.first_step..step;
            steps.zip(&span.digests).map(|(_, digest)| *digest)
        })
    }
}

/// The state beside the particles and the scene's step. It rarely changes, and encoding it takes as long
/// as a part of a small scene's step.
#[derive(Debug)]
struct Rest {
    digest: u64,
    torn_count: usize,
    frozen_count: u64,
}

impl Rest {
    fn new(solver: &Solver) -> Self {
        Self {
            digest: xxh3_64(&solver.keyframe().at_scene_step(0).encode()),
            torn_count: solver.torn().len(),
            frozen_count: solver.frozen_count(),
        }
    }

    /// Returns `true` if a step without commands before it has changed nothing of this.
    fn is_same(&self, solver: &Solver) -> bool {
        !solver.changes_without_commands()
            && self.torn_count == solver.torn().len()
            && self.frozen_count == solver.frozen_count()
    }

    /// Returns the digest of the complete state.
    fn state_digest(&self, solver: &Solver, state_hash: u64) -> u64 {
        let parts = [state_hash, solver.scene_step(), self.digest];
        xxh3_64(&parts.map(u64::to_le_bytes).concat())
    }
}
