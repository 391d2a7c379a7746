//! The states that a re-simulation has computed, to prove those that a command puts in place again.

use std::collections::HashSet;

use sim_contract::Action;
use sim_solver::Solver;
use xxhash_rust::xxh3::xxh3_64;

/// Digests of the computed states.
#[derive(Debug)]
pub(super) struct PastStates {
    first_step: u64,
    /// By step, from the first one. 8 bytes each: a day at 240 Hz takes 166 MB.
    digests: Vec<u64>,
    /// The same without their steps, made for the first state that was given.
    all: Option<HashSet<u64>>,
    /// The rest of the newest state.
    rest: Rest,
    /// Number of states that were taken from the file without a proof.
    pub(super) given_count: u64,
}

impl PastStates {
    /// Starts with the first state.
    pub(super) fn from_first(first_step: u64, solver: &Solver) -> Self {
        let rest = Rest::new(solver);
        Self {
            first_step,
            digests: vec![rest.state_digest(solver, solver.state_hash())],
            all: None,
            rest,
            given_count: 0,
        }
    }

    /// Starts again with a state that was taken from the file.
    pub(super) fn restart(&mut self, step: u64, solver: &Solver) {
        let given_count = self.given_count;
        *self = Self { given_count, ..Self::from_first(step, solver) };
    }

    /// Adds the state after the next step. `is_commanded` is true if commands precede the step.
    pub(super) fn add(&mut self, solver: &Solver, is_commanded: bool) {
        if is_commanded || !self.rest.is_same(solver) {
            self.rest = Rest::new(solver);
        }
        let digest = self.rest.state_digest(solver, solver.state_hash());
        self.digests.push(digest);
        if let Some(all) = &mut self.all {
            all.insert(digest);
        }
    }

    /// Compares a state that an action has put in place with the computed ones. Counts a state that none
    /// of them proves. Returns a description of a difference.
    pub(super) fn compare(&mut self, action: &Action, solver: &Solver) -> Option<String> {
        let state_hash = solver.hash_in_place();
        let digest = Rest::new(solver).state_digest(solver, state_hash);
        match *action {
            Action::Rewind { to_step: Some(to_step), back_steps: None } => {
                self.compare_rewind(to_step, digest)
            }
            Action::Restore { state_hash: recorded, .. } if recorded != state_hash => {
                Some(format!(
                    "state_hash: recorded {recorded:016x}, but the state in place has {state_hash:016x}"
                ))
            }
            Action::Restore { .. } => {
                let Self { digests, all, .. } = self;
                let all = all.get_or_insert_with(|| digests.iter().copied().collect());
                self.given_count += u64::from(!all.contains(&digest));
                None
            }
            _ => Some("it does not name the step of the state".to_owned()),
        }
    }

    fn compare_rewind(&mut self, to_step: u64, digest: u64) -> Option<String> {
        let Some(index) = to_step.checked_sub(self.first_step) else {
            self.given_count += 1;
            return None;
        };
        let known = usize::try_from(index).ok().and_then(|index| self.digests.get(index));
        match known {
            Some(known) if *known == digest => None,
            Some(_) => Some(format!("the state in place is not that of step {to_step}")),
            None => Some(format!("it goes back to step {to_step}, which is later")),
        }
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
