//! Reads chunks on demand, finds them by topic, and caches their content.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use sim_messages::{ParticleState, Torn, TornConstraint};

use crate::log::index::{ChunkEntry, IndexedLog};
use crate::log::message::Message;
use crate::log::read_error::ReadError;
use crate::log::rows::{CollidersRow, ForcesRow, ParametersRow, StatusRow, StepRow};
use crate::log::tears::{TearChange, torn_in_keyframe};
use crate::log::topic::Topic;

/// Chunks whose particles and forces are cached: the one that is played and the one before it.
const STEPS_CHUNKS_MAX: usize = 2;

/// The digest of a chunk that cannot be read.
static EMPTY_DIGEST: Digest = Digest::empty();

/// The particles and forces of the steps in a chunk, which are too large for a digest.
#[derive(Debug)]
struct Steps {
    chunk: usize,
    snapshots: Vec<(u64, Arc<Vec<ParticleState>>)>,
    forces: Vec<ForcesRow>,
}

/// Reads chunks on demand and caches their content. A chunk that cannot be read counts as empty.
#[derive(Debug)]
pub(super) struct ChunkReader {
    log: IndexedLog,
    pub(super) chunks: Chunks,
    digests: DigestCache,
    /// The steps of the chunks that were read last, newest last.
    steps: VecDeque<Steps>,
    /// Errors that [`Self::drain_faults`] has not returned yet.
    faults: Vec<String>,
}

impl ChunkReader {
    pub(super) fn new(log: IndexedLog) -> Self {
        let chunks = Chunks::new(log.chunks());
        Self {
            log,
            chunks,
            digests: DigestCache::default(),
            steps: VecDeque::new(),
            faults: Vec::new(),
        }
    }

    pub(super) fn log(&self) -> &IndexedLog {
        &self.log
    }

    pub(super) fn drain_faults(&mut self) -> Vec<String> {
        std::mem::take(&mut self.faults)
    }

    /// Returns the digest of a chunk. Reads the chunk if the digest is not cached.
    pub(super) fn digest(&mut self, chunk: usize) -> Result<&Digest, ReadError> {
        if self.digests.get(chunk).is_none() {
            self.read(chunk)?;
        }
        Ok(self.digests.get(chunk).unwrap_or(&EMPTY_DIGEST))
    }

    /// Returns the steps of the snapshots in a chunk. Reads the chunk if it was never read.
    pub(super) fn span(&mut self, chunk: usize) -> Result<ChunkSpan, ReadError> {
        if self.chunks.span(chunk).is_none() {
            self.digest(chunk)?;
        }
        Ok(self.chunks.span(chunk).unwrap_or(ChunkSpan::Empty))
    }

    /// Returns the particles of a snapshot, if the chunk has it.
    pub(super) fn particles(
        &mut self,
        chunk: usize,
        step: u64,
    ) -> Result<Option<Arc<Vec<ParticleState>>>, ReadError> {
        let mut snapshots = self.steps(chunk)?.into_iter().flat_map(|steps| &steps.snapshots);
        let snapshot = snapshots.find(|(snapshot_step, _)| *snapshot_step == step);
        Ok(snapshot.map(|(_, particles)| Arc::clone(particles)))
    }

    /// Returns the forces of a step, if the chunk has them.
    pub(super) fn forces(
        &mut self,
        chunk: usize,
        step: u64,
    ) -> Result<Option<ForcesRow>, ReadError> {
        let mut rows = self.steps(chunk)?.into_iter().flat_map(|steps| &steps.forces);
        Ok(rows.find(|row| row.step == step).cloned())
    }

    /// Returns the steps of a chunk. Reads the chunk if they are not cached.
    fn steps(&mut self, chunk: usize) -> Result<Option<&Steps>, ReadError> {
        if !self.steps.iter().any(|steps| steps.chunk == chunk) {
            self.read(chunk)?;
        }
        Ok(self.steps.iter().find(|steps| steps.chunk == chunk))
    }

    /// Returns the newest keyframe of a chunk up to a step.
    pub(super) fn keyframe(
        &mut self,
        chunk: usize,
        step: u64,
    ) -> Result<Option<(u64, Vec<u8>)>, ReadError> {
        let messages = self.log.read_chunk(chunk)?.into_iter().rev();
        let mut keyframes = messages.filter_map(|logged| match logged.message {
            Message::Keyframe { step, bytes } => Some((step, bytes)),
            _ => None,
        });
        Ok(keyframes.find(|(keyframe_step, _)| *keyframe_step <= step))
    }

    /// Returns the newest value that `pick` selects, up to a chunk.
    pub(super) fn latest<T>(
        &mut self,
        topic: Topic,
        chunk: usize,
        pick: impl Fn(&Digest) -> Option<T>,
    ) -> Result<Option<T>, ReadError> {
        for chunk in self.chunks.with_topic(topic).backward_from(chunk) {
            if let Some(value) = pick(self.digest(chunk)?) {
                return Ok(Some(value));
            }
        }
        Ok(None)
    }

    fn read(&mut self, chunk: usize) -> Result<(), ReadError> {
        let mut faults = Vec::new();
        let messages = match self.log.read_chunk(chunk) {
            Ok(messages) => messages,
            Err(error @ (ReadError::DamagedChunk { .. } | ReadError::Malformed { .. })) => {
                faults.push(error.to_string());
                Vec::new()
            }
            Err(error) => return Err(error),
        };
        let mut digest = Digest::default();
        let mut steps = Steps { chunk, snapshots: Vec::new(), forces: Vec::new() };
        for logged in messages {
            if let Message::Particles { step, particles } = &logged.message
                && particles.len() != self.log.run().particle_count as usize
            {
                let (count, expected) = (particles.len(), self.log.run().particle_count);
                faults.push(format!(
                    "the snapshot of step {step} has {count} particles instead of {expected}"
                ));
                continue;
            }
            digest.add(&logged.message);
            match logged.message {
                Message::Particles { step, particles } => {
                    steps.snapshots.push((step, Arc::new(particles)));
                }
                Message::Forces(row) => steps.forces.push(row),
                _ => {}
            }
        }
        // A chunk that is read again after its digest was dropped reports its faults only once.
        if self.chunks.span(chunk).is_none() {
            self.faults.append(&mut faults);
        }
        self.chunks.set_span(chunk, &digest.snapshots);
        self.digests.insert(chunk, digest);
        self.steps.retain(|one| one.chunk != chunk);
        self.steps.push_back(steps);
        if self.steps.len() > STEPS_CHUNKS_MAX {
            self.steps.pop_front();
        }
        Ok(())
    }
}

/// The chunks of a file by topic, and the steps in the chunks that have been read.
#[derive(Debug)]
pub(super) struct Chunks {
    by_topic: Vec<ChunkList>,
    tears: ChunkList,
    /// Steps of the snapshots in each chunk. `None` until the chunk is read.
    spans: Vec<Option<ChunkSpan>>,
}

/// The steps of the snapshots in a chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChunkSpan {
    Empty,
    Steps { first: u64, last: u64 },
}

/// Chunk numbers, ascending.
#[derive(Debug, Clone)]
pub(super) struct ChunkList(pub(super) Arc<[usize]>);

impl ChunkList {
    fn new(chunks: &[ChunkEntry], topics: &[Topic]) -> Self {
        let all = chunks.iter().enumerate();
        Self(all.filter(|(_, chunk)| chunk.has_any(topics)).map(|(number, _)| number).collect())
    }

    /// Returns the chunks from `chunk` to the end.
    pub(super) fn forward_from(self, chunk: usize) -> impl Iterator<Item = usize> {
        let begin = self.0.partition_point(|one| *one < chunk);
        (begin..self.0.len()).map(move |place| self.0[place])
    }

    /// Returns the chunks from `chunk` back to the start.
    pub(super) fn backward_from(self, chunk: usize) -> impl Iterator<Item = usize> {
        let end = self.0.partition_point(|one| *one <= chunk);
        (0..end).rev().map(move |place| self.0[place])
    }
}

impl Chunks {
    pub(super) fn new(chunks: &[ChunkEntry]) -> Self {
        Self {
            by_topic: Topic::ALL.iter().map(|topic| ChunkList::new(chunks, &[*topic])).collect(),
            tears: ChunkList::new(chunks, &[Topic::Tears, Topic::Outcomes]),
            spans: vec![None; chunks.len()],
        }
    }

    /// Returns the chunks with messages on a topic.
    pub(super) fn with_topic(&self, topic: Topic) -> ChunkList {
        self.by_topic[topic.index()].clone()
    }

    /// Returns the chunks with tears or resets.
    pub(super) fn with_tear_changes(&self) -> ChunkList {
        self.tears.clone()
    }

    /// Returns the steps in a chunk, or `None` if it has not been read.
    pub(super) fn span(&self, chunk: usize) -> Option<ChunkSpan> {
        self.spans[chunk]
    }

    /// Stores the steps in a chunk.
    pub(super) fn set_span(&mut self, chunk: usize, steps: &[u64]) {
        self.spans[chunk] = Some(match (steps.first(), steps.last()) {
            (Some(first), Some(last)) => ChunkSpan::Steps { first: *first, last: *last },
            _ => ChunkSpan::Empty,
        });
    }
}

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
