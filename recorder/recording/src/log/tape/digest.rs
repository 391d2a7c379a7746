//! The content of a chunk without its particles, small enough to keep for many chunks.

use std::collections::BTreeMap;

use sim_contract::{Torn, TornConstraint};

use crate::log::message::Message;
use crate::log::rows::{CollidersRow, ParametersRow, StatusRow, StepRow};
use crate::log::tears::{TearChange, torn_in_keyframe};

/// Most memory for digests, in bytes: minutes of a large scene that tears in every step.
const CACHE_SIZE_BYTES_MAX: usize = 64 << 20;

/// The content of a chunk without its particles.
#[derive(Debug, Default)]
pub(super) struct Digest {
    /// Steps of its snapshots, ascending.
    pub(super) snapshots: Vec<u64>,
    pub(super) rows: Vec<StepRow>,
    /// The torn list is `None` if the keyframe has another version.
    pub(super) keyframes: Vec<(u64, Option<Torn>)>,
    pub(super) changes: Vec<TearChange>,
    pub(super) colliders: Vec<CollidersRow>,
    pub(super) parameters: Vec<ParametersRow>,
    pub(super) statuses: Vec<StatusRow>,
    size_bytes: usize,
}

impl Digest {
    /// Returns the digest of a chunk without messages.
    pub(super) const fn empty() -> Self {
        Self {
            snapshots: Vec::new(),
            rows: Vec::new(),
            keyframes: Vec::new(),
            changes: Vec::new(),
            colliders: Vec::new(),
            parameters: Vec::new(),
            statuses: Vec::new(),
            size_bytes: 0,
        }
    }

    /// Adds a message.
    pub(super) fn add(&mut self, message: &Message) {
        self.changes.extend(TearChange::from_message(message));
        self.size_bytes += size_of::<Message>();
        match message {
            Message::Particles { step, .. } => self.snapshots.push(*step),
            Message::Step(row) => self.rows.push(*row),
            Message::Keyframe { step, bytes } => {
                let torn = torn_in_keyframe(bytes);
                let count = torn.as_ref().map_or(0, |torn| torn.constraints.len());
                self.size_bytes += count * size_of::<TornConstraint>();
                self.keyframes.push((*step, torn));
            }
            Message::Colliders(row) => {
                self.size_bytes += message.size_bytes();
                self.colliders.push(row.clone());
            }
            Message::Tears(_) | Message::Outcome(_) => self.size_bytes += message.size_bytes(),
            Message::Parameters(row) => {
                self.size_bytes += message.size_bytes();
                self.parameters.push(row.clone());
            }
            Message::Status(row) => {
                self.size_bytes += message.size_bytes();
                self.statuses.push(row.clone());
            }
            _ => {}
        }
    }

    /// Returns the header of a snapshot, if it is in this chunk.
    pub(super) fn row(&self, step: u64) -> Option<StepRow> {
        self.rows.iter().rfind(|row| row.step == step).copied()
    }

    /// Returns the newest keyframe up to a step, with its torn list.
    pub(super) fn keyframe(&self, step: u64) -> Option<&(u64, Option<Torn>)> {
        self.keyframes.iter().rfind(|(keyframe_step, _)| *keyframe_step <= step)
    }
}

/// A cache of digests that drops the least recently used ones.
#[derive(Debug, Default)]
pub(super) struct DigestCache {
    /// The time of the last use and the digest, by chunk.
    by_chunk: BTreeMap<usize, (u64, Digest)>,
    /// Number of uses.
    clock: u64,
    size_bytes: usize,
}

impl DigestCache {
    pub(super) fn get(&mut self, chunk: usize) -> Option<&Digest> {
        self.clock += 1;
        let (used, digest) = self.by_chunk.get_mut(&chunk)?;
        *used = self.clock;
        Some(digest)
    }

    /// Stores a digest and drops the least recently used ones beyond the limit.
    pub(super) fn insert(&mut self, chunk: usize, digest: Digest) {
        self.size_bytes += size_of::<Digest>() + digest.size_bytes;
        self.clock += 1;
        if let Some((_, replaced)) = self.by_chunk.insert(chunk, (self.clock, digest)) {
            self.size_bytes -= size_of::<Digest>() + replaced.size_bytes;
        }
        while self.size_bytes > CACHE_SIZE_BYTES_MAX && self.by_chunk.len() > 1 {
            let oldest = self.by_chunk.iter().min_by_key(|(_, (used, _))| *used);
            let Some(oldest) = oldest.map(|(chunk, _)| *chunk) else { break };
            if let Some((_, dropped)) = self.by_chunk.remove(&oldest) {
                self.size_bytes -= size_of::<Digest>() + dropped.size_bytes;
            }
        }
    }
}
