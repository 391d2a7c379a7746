//! The state hash of a recorded snapshot, and its seed: the torn constraints.

use sim_contract::{ParticleState, Torn};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use super::message::Message;
use super::rows::StepRow;
use super::tears::TearTracker;

/// Returns the XXH3-64 of the particles, as the solver computes it.
///
/// `torn` holds all torn constraints of this state, in any order. The seed is 0 while it is empty.
/// Otherwise the seed is the XXH3-64 of the indices, ascending, as little-endian u32.
pub fn state_hash(particles: &[ParticleState], torn: &[u32]) -> u64 {
    hash_bytes(bytemuck::cast_slice(particles), hash_seed(torn.to_vec()))
}

/// Returns the seed of the hash for these torn constraints.
pub(in crate::log) fn hash_seed(mut torn: Vec<u32>) -> u64 {
    torn.sort_unstable();
    let bytes: Vec<u8> = torn.iter().flat_map(|index| index.to_le_bytes()).collect();
    if bytes.is_empty() { 0 } else { xxh3_64(&bytes) }
}

/// Returns the hash of the bytes of particles.
pub(in crate::log) fn hash_bytes(particles: &[u8], seed: u64) -> u64 {
    xxh3_64_with_seed(particles, seed)
}

/// The seed of the hash of each snapshot, from the messages before it.
#[derive(Debug)]
pub(super) struct HashSeeds {
    tracker: TearTracker,
    /// `step` minus `scene_step` of the newest snapshot: it changes when a state is put in place.
    beginning: Option<u64>,
    /// The newest step in which a recorded command put a state in place.
    replacement_step: Option<u64>,
    /// The seed of the newest snapshot, and the tears that it stands for.
    newest: Option<(TornKey, u64)>,
}

/// A number of tears since a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TornKey {
    since_step: u64,
    count: u32,
}

impl HashSeeds {
    pub(super) fn new() -> Self {
        Self {
            tracker: TearTracker::new(Torn::default()),
            beginning: None,
            replacement_step: None,
            newest: None,
        }
    }

    /// Processes a message between snapshots.
    pub(super) fn process(&mut self, message: &Message) {
        self.replacement_step = message.replacement_step().max(self.replacement_step);
        if let Message::Topology(row) = message
            && self.beginning.is_none()
        {
            self.tracker = TearTracker::new(row.torn_before());
            self.newest = None;
        }
        self.tracker.process(message);
    }

    /// Marks a part of the file as missing.
    pub(super) fn mark_gap(&mut self) {
        self.tracker.mark_gap();
        self.newest = None;
    }

    /// Returns the seed for a snapshot, or `None` if its torn constraints are unknown.
    pub(super) fn seed(&mut self, row: &StepRow) -> Option<u64> {
        let beginning = row.step.wrapping_sub(row.scene_step);
        let last = self.beginning.replace(beginning);
        let is_new = last.is_some_and(|last| last != beginning);
        let is_explained = self.replacement_step.take_if(|step| *step <= row.step).is_some();
        if is_new && !is_explained {
            self.mark_gap();
        }
        if row.torn_count == 0 {
            return Some(hash_seed(Vec::new()));
        }
        let torn = self.tracker.torn()?;
        let count = usize::try_from(row.torn_count).unwrap_or(usize::MAX);
        let first = torn.constraints.get(..count)?;
        let key = TornKey { since_step: torn.header.since_step, count: row.torn_count };
        if let Some((newest, seed)) = self.newest
            && newest == key
        {
            return Some(seed);
        }
        let seed = hash_seed(first.iter().map(|one| one.constraint).collect());
        self.newest = Some((key, seed));
        Some(seed)
    }
}

#[cfg(test)]
mod tests {
    use sim_solver::{Scene, Solver};

    use super::*;

    #[test]
    fn the_hash_equals_the_solvers_hash_with_and_without_torn_constraints() {
        let text = "generate = [{ shape = 'cloth', columns = 4, rows = 4, spacing = 0.1 }]";
        let scene = Scene::from_toml(&format!("version = 1\n{text}"), "scene.toml").unwrap();
        let mut solver = Solver::new(&scene);
        let hash =
            |solver: &Solver| state_hash(bytemuck::cast_slice(solver.particles()), solver.torn());
        solver.step();
        assert_eq!(hash(&solver), solver.state_hash());
        for constraint in [7, 3] {
            solver.cut(constraint).unwrap();
        }
        solver.step();
        assert_eq!((solver.torn().len(), hash(&solver)), (2, solver.state_hash()));
    }
}
