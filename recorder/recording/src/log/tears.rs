//! The torn constraints, tracked through the messages of a recording, and the state hash, whose seed they are.

use sim_messages::{ParticleState, Torn, TornConstraint};
use sim_solver::Keyframe;
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use super::message::Message;
use super::rows::{StepRow, TearsRow};

/// A change of the torn constraints.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TearChange {
    /// From this step on, the earlier tears are undone. Those of a state that was put in place follow as
    /// tears of the same step.
    Reset(u64),
    /// New tears.
    Tears(TearsRow),
}

/// Returns the torn constraints in a keyframe, or `None` if it is damaged or has another version.
pub(crate) fn torn_in_keyframe(bytes: &[u8]) -> Option<Torn> {
    let keyframe = Keyframe::decode(bytes).ok()?;
    let pairs = keyframe.torn().iter().zip(keyframe.tear_causes());
    Some(pairs.map(|(index, cause)| TornConstraint::new(*index, Some(*cause))).collect())
}

impl TearChange {
    /// Returns the change that a message describes, if any.
    pub(crate) fn from_message(message: &Message) -> Option<Self> {
        match message {
            Message::Tears(row) => Some(Self::Tears(row.clone())),
            _ => message.replacement_step().map(Self::Reset),
        }
    }

    /// Returns the first step with the change.
    pub(crate) fn step(&self) -> u64 {
        match self {
            Self::Reset(step) => *step,
            Self::Tears(row) => row.step,
        }
    }

    pub(crate) fn apply(&self, torn: &mut Torn) {
        match self {
            Self::Reset(step) => torn.reset(*step),
            Self::Tears(row) => torn.extend(row.step, row.torn()),
        }
    }
}

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
#[derive(Debug, Default)]
pub struct HashSeeds {
    torn: Torn,
    /// A part of the file is missing since the last keyframe.
    is_unknown: bool,
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
    /// Processes a message between snapshots. Most messages do not concern tears.
    pub fn process(&mut self, message: &Message) {
        self.replacement_step = message.replacement_step().max(self.replacement_step);
        let known = match message {
            Message::Topology(row) if self.beginning.is_none() => Some(row.torn_before()),
            Message::Keyframe { bytes, .. } if self.is_unknown => torn_in_keyframe(bytes),
            _ => None,
        };
        if let Some(torn) = known {
            (self.torn, self.is_unknown, self.newest) = (torn, false, None);
        } else if let Some(change) = TearChange::from_message(message) {
            change.apply(&mut self.torn);
        }
    }

    /// Marks a part of the file as missing. The torn constraints are unknown until the next keyframe.
    pub fn mark_gap(&mut self) {
        (self.is_unknown, self.newest) = (true, None);
    }

    /// Compares a snapshot with the hash in its header. Returns `None` if its torn constraints are unknown.
    pub fn is_equal(&mut self, row: &StepRow, particles: &[ParticleState]) -> Option<bool> {
        let seed = self.seed(row)?;
        Some(hash_bytes(bytemuck::cast_slice(particles), seed) == row.state_hash)
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
        if self.is_unknown {
            return None;
        }
        let first = self.torn.constraints.get(..row.torn_count as usize)?;
        let key = TornKey { since_step: self.torn.header.since_step, count: row.torn_count };
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
    fn after_a_gap_the_torn_constraints_are_unknown() {
        let mut seeds = HashSeeds::default();
        let row = StepRow { step: 4, torn_count: 1, ..StepRow::default() };
        let tears = TearsRow { step: 2, constraints: vec![7], causes: vec!["cut".to_owned()] };
        seeds.process(&Message::Tears(tears));
        assert_eq!(seeds.seed(&row), Some(hash_seed(vec![7])));
        seeds.mark_gap();
        seeds.process(&Message::Keyframe { step: 3, bytes: vec![1, 2, 3] });
        assert_eq!(seeds.seed(&row), None);
    }

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
