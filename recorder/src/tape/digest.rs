//! What a chunk says beside its particles: small enough to be kept for many chunks.

use std::collections::BTreeMap;

use crate::collider_rows::CollidersRow;
use crate::keyframe_tears::KeyframeTears;
use crate::message::Message;
use crate::rows::{StatusRow, StepRow};
use crate::tears::TearChange;

/// Most memory that digests take, in bytes: minutes of a large scene that tears all the time.
const KEPT_SIZE_BYTES_MAX: usize = 64 << 20;

/// What a chunk says beside its particles.
#[derive(Debug, Default)]
pub(super) struct Digest {
    /// The steps of its snapshots, ascending.
    pub(super) snapshots: Vec<u64>,
    pub(super) rows: Vec<StepRow>,
    /// `None` where a keyframe is of another version.
    pub(super) keyframes: Vec<(u64, Option<KeyframeTears>)>,
    pub(super) changes: Vec<TearChange>,
    pub(super) colliders: Vec<CollidersRow>,
    pub(super) statuses: Vec<StatusRow>,
    size_bytes: usize,
}

impl Digest {
    /// That of a chunk without messages.
    pub(super) const fn empty() -> Self {
        Self {
            snapshots: Vec::new(),
            rows: Vec::new(),
            keyframes: Vec::new(),
            changes: Vec::new(),
            colliders: Vec::new(),
            statuses: Vec::new(),
            size_bytes: 0,
        }
    }

    /// Takes a message.
    pub(super) fn take(&mut self, message: &Message) {
        self.changes.extend(TearChange::of(message));
        self.size_bytes += size_of::<Message>();
        match message {
            Message::Particles { step, .. } => self.snapshots.push(*step),
            Message::Step(row) => self.rows.push(*row),
            Message::Keyframe { step, bytes } => {
                let tears = KeyframeTears::read(bytes);
                let count = tears.as_ref().map_or(0, |tears| tears.torn.len());
                self.size_bytes += count * 2 * size_of::<u32>();
                self.keyframes.push((*step, tears));
            }
            Message::Colliders(row) => {
                self.size_bytes += message.size_bytes();
                self.colliders.push(row.clone());
            }
            Message::Tears(_) => self.size_bytes += message.size_bytes(),
            Message::Status(row) => self.statuses.push(row.clone()),
            _ => {}
        }
    }

    /// The header of a snapshot, if it is in this chunk.
    pub(super) fn row(&self, step: u64) -> Option<StepRow> {
        self.rows.iter().rfind(|row| row.step == step).copied()
    }

    /// The newest keyframe up to a step; what is torn is `None` if it is of another version.
    pub(super) fn keyframe(&self, step: u64) -> Option<&(u64, Option<KeyframeTears>)> {
        self.keyframes.iter().rfind(|(of, _)| *of <= step)
    }
}

/// The digests of the chunks that were read last, as far as there is room.
#[derive(Debug, Default)]
pub(super) struct Digests {
    by_chunk: BTreeMap<usize, (u64, Digest)>,
    /// Counts the uses.
    clock: u64,
    size_bytes: usize,
}

impl Digests {
    pub(super) fn get(&mut self, chunk: usize) -> Option<&Digest> {
        self.clock += 1;
        let (used, digest) = self.by_chunk.get_mut(&chunk)?;
        *used = self.clock;
        Some(digest)
    }

    /// Keeps one; the ones that were not used for longest go.
    pub(super) fn put(&mut self, chunk: usize, digest: Digest) {
        self.size_bytes += digest.size_bytes;
        self.clock += 1;
        if let Some((_, before)) = self.by_chunk.insert(chunk, (self.clock, digest)) {
            self.size_bytes -= before.size_bytes;
        }
        while self.size_bytes > KEPT_SIZE_BYTES_MAX && self.by_chunk.len() > 1 {
            let oldest = self.by_chunk.iter().min_by_key(|(_, (used, _))| *used);
            let Some(oldest) = oldest.map(|(chunk, _)| *chunk) else { break };
            if let Some((_, gone)) = self.by_chunk.remove(&oldest) {
                self.size_bytes -= gone.size_bytes;
            }
        }
    }
}
