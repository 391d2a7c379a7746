//! Reads chunks on demand and caches their content.

use std::collections::VecDeque;
use std::sync::Arc;

use sim_contract::ParticleState;

use super::chunks::{Chunks, Span};
use super::digest::{Digest, DigestCache};
use crate::log::index::IndexedLog;
use crate::log::message::Message;
use crate::log::read::read_error::ReadError;
use crate::log::topic::Topic;

/// Chunks whose particles are cached: the one that is played and the one before it.
const PARTICLE_CHUNKS_MAX: usize = 2;

/// The digest of a chunk that cannot be read.
static EMPTY_DIGEST: Digest = Digest::empty();

/// Steps and their particles.
type Snapshots = Vec<(u64, Arc<Vec<ParticleState>>)>;

/// Reads chunks on demand and caches their content. A chunk that cannot be read counts as empty.
#[derive(Debug)]
pub(super) struct ChunkReader {
    log: IndexedLog,
    pub(super) chunks: Chunks,
    digests: DigestCache,
    /// The snapshots of the chunks that were read last, newest last.
    particles: VecDeque<(usize, Snapshots)>,
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
            particles: VecDeque::new(),
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
        if !self.particles.iter().any(|(cached, _)| *cached == chunk) {
            self.read(chunk)?;
        }
        let mut snapshots =
            self.particles.iter().filter(|(cached, _)| *cached == chunk).flat_map(|(_, all)| all);
        let snapshot = snapshots.find(|(snapshot_step, _)| *snapshot_step == step);
        Ok(snapshot.map(|(_, particles)| Arc::clone(particles)))
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
        let (mut digest, mut snapshots) = (Digest::default(), Vec::new());
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
            if let Message::Particles { step, particles } = logged.message {
                snapshots.push((step, Arc::new(particles)));
            }
        }
        // A chunk that is read again after its digest was dropped reports its faults only once.
        if self.chunks.span(chunk).is_none() {
            self.faults.append(&mut faults);
        }
        self.chunks.set_span(chunk, &digest.snapshots);
        self.digests.insert(chunk, digest);
        self.particles.retain(|(cached, _)| *cached != chunk);
        self.particles.push_back((chunk, snapshots));
        if self.particles.len() > PARTICLE_CHUNKS_MAX {
            self.particles.pop_front();
        }
        Ok(())
    }
}
