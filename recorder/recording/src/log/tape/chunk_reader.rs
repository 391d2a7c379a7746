//! Reads chunks on demand and caches their content.

use std::collections::VecDeque;
use std::sync::Arc;

use sim_contract::ParticleState;

use super::chunks::{Chunks, Span};
use super::digest::{Digest, DigestCache};
use crate::log::index::IndexedLog;
use crate::log::message::Message;
use crate::log::read_error::ReadError;
use crate::log::rows::ForcesRow;
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
    pub(super) fn span(&mut self, chunk: usize) -> Result<Span, ReadError> {
        if self.chunks.span(chunk).is_none() {
            self.digest(chunk)?;
        }
        Ok(self.chunks.span(chunk).unwrap_or(Span::Empty))
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
