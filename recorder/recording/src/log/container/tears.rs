//! The torn constraints of each snapshot, as the seed of its hash.

use crate::log::message::Message;
use crate::log::rows::StepRow;
use crate::log::state_hash::hash_seed;
use crate::log::tears::TearTracker;
use sim_contract::Torn;

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
