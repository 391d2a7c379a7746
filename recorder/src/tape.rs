//! A recording as a tape that can be wound to any step: the state there, with what is torn and where
//! colliders stand, from the chunks around it alone.

mod digest;
mod load;
mod search;

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;

use sim_contract::ParticleState;

use crate::collider_rows::CollidersRow;
use crate::index::IndexedLog;
use crate::message::Message;
use crate::reader::ReadError;
use crate::records::LogEnd;
use crate::rows::{StatusRow, StepRow, SurfaceRow, TopologyRow};
use crate::run::RunDescription;
use crate::tears::{Torn, TornFollower};
use crate::topic::Topic;
use digest::{Digest, Digests};
use search::Chunks;

/// Chunks whose particles are kept: the one that is played, and the one before it.
const CHUNKS_KEPT_MAX: usize = 2;

/// Why a recording cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum TapeError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is nothing to show.
    #[error("has no snapshot to show (the file is {0})")]
    NoSnapshot(LogEnd),
    /// Its scene is missing.
    #[error("has no readable {0} before its first snapshot")]
    NoLoad(&'static str),
}

/// A recording that can be wound to any step.
#[derive(Debug)]
pub struct Tape {
    log: IndexedLog,
    chunks: Chunks,
    digests: Digests,
    /// The snapshots of the chunks that were read last, newest last.
    particles: VecDeque<(usize, Snapshots)>,
    /// What could not be read, since it was asked for.
    faults: Vec<String>,
    topology: TopologyRow,
    surface: SurfaceRow,
    first_step: u64,
    last_step: u64,
    stride: u64,
}

/// Of a chunk that is not there.
static NO_DIGEST: Digest = Digest::empty();

/// Steps and their particles.
type Snapshots = Vec<(u64, Arc<Vec<ParticleState>>)>;

/// The state of a recorded step.
#[derive(Debug, Clone)]
pub struct TapeState {
    /// The header of its snapshot; all but the step is 0 where the file has lost it.
    pub row: StepRow,
    /// Shape: particle count.
    pub particles: Arc<Vec<ParticleState>>,
    /// What is torn in it.
    pub torn: Torn,
    /// Where the colliders stand, if there are any.
    pub colliders: Option<CollidersRow>,
    /// What the node said of itself last, if it did.
    pub status: Option<StatusRow>,
}

impl Tape {
    /// Opens a recording. `on_walk` is told how many bytes of how many have been looked through,
    /// if there is no index; never, if there is one.
    ///
    /// # Errors
    /// If it is no recording, or there is nothing in it to show.
    pub fn open(path: &Path, on_walk: &mut dyn FnMut(u64, u64)) -> Result<Self, TapeError> {
        let log = IndexedLog::open_telling(path, on_walk)?;
        let chunks = Chunks::new(log.chunks());
        let mut tape = Self {
            log,
            chunks,
            digests: Digests::default(),
            particles: VecDeque::new(),
            faults: Vec::new(),
            topology: load::no_topology(),
            surface: load::no_surface(),
            first_step: 0,
            last_step: 0,
            stride: 1,
        };
        tape.read_ends()?;
        Ok(tape)
    }

    /// The run that was recorded.
    pub fn run(&self) -> &RunDescription {
        self.log.run()
    }

    /// The file, chunk by chunk.
    pub fn log(&self) -> &IndexedLog {
        &self.log
    }

    /// The constraints.
    pub fn topology(&self) -> &TopologyRow {
        &self.topology
    }

    /// The triangles.
    pub fn surface(&self) -> &SurfaceRow {
        &self.surface
    }

    /// The first recorded step.
    pub fn first_step(&self) -> u64 {
        self.first_step
    }

    /// The last recorded step.
    pub fn last_step(&self) -> u64 {
        self.last_step
    }

    /// Steps from one snapshot to the next, where none is missing.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// What could not be read since the last call, for users; of a part that is read again, once.
    pub fn take_faults(&mut self) -> Vec<String> {
        std::mem::take(&mut self.faults)
    }

    /// The recorded step at a step, or the last one before it; the first one, if there is none.
    ///
    /// # Errors
    /// If the operating system says no.
    pub fn step_at(&mut self, step: u64) -> Result<u64, ReadError> {
        let step = step.clamp(self.first_step, self.last_step);
        Ok(self.find(step)?.map_or(self.first_step, |(_, step)| step))
    }

    /// The next recorded step after a recorded step; that itself, if it is the last one.
    ///
    /// # Errors
    /// If the operating system says no.
    pub fn step_after(&mut self, step: u64) -> Result<u64, ReadError> {
        let Some((chunk, _)) = self.find(step)? else { return Ok(self.first_step) };
        for chunk in self.chunks.of(Topic::Particles).from(chunk) {
            let next = self.digest(chunk)?.snapshots.iter().find(|one| **one > step).copied();
            if let Some(next) = next {
                return Ok(next);
            }
        }
        Ok(step)
    }

    /// The state of the recorded step at a step, or of the last one before it.
    ///
    /// # Errors
    /// If the operating system says no, or no snapshot is readable any more.
    pub fn state_at(&mut self, step: u64) -> Result<TapeState, TapeError> {
        let step = step.clamp(self.first_step, self.last_step);
        let nothing = || TapeError::NoSnapshot(LogEnd::Whole);
        let (chunk, step) = self.find(step)?.ok_or_else(nothing)?;
        let particles = self.particles_of(chunk, step)?.ok_or_else(nothing)?;
        let row = self.row_of(chunk, step)?;
        let mut torn = self.torn_at(chunk, step)?;
        if let Some(row) = &row {
            torn.constraints.truncate(row.torn_count as usize);
            torn.causes.truncate(row.torn_count as usize);
        }
        let row = row.unwrap_or(StepRow { step, ..StepRow::default() });
        let colliders = self.latest(Topic::Colliders, chunk, |digest| {
            digest.colliders.iter().rfind(|row| row.step <= step).cloned()
        })?;
        let status = self.latest(Topic::Status, chunk, |digest| {
            digest.statuses.iter().rfind(|row| row.step <= step).cloned()
        })?;
        Ok(TapeState { row, particles, torn, colliders, status })
    }

    /// Reads a chunk, unless what it says is known. What cannot be read says nothing.
    fn digest(&mut self, chunk: usize) -> Result<&Digest, ReadError> {
        if self.digests.get(chunk).is_none() {
            self.read(chunk)?;
        }
        Ok(self.digests.get(chunk).unwrap_or(&NO_DIGEST))
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
                let count = particles.len();
                faults.push(format!("the snapshot of step {step} has {count} particles"));
                continue;
            }
            digest.take(&logged.message);
            if let Message::Particles { step, particles } = logged.message {
                snapshots.push((step, Arc::new(particles)));
            }
        }
        if !self.chunks.is_known(chunk) {
            self.faults.append(&mut faults);
        }
        self.chunks.set_span(chunk, &digest.snapshots);
        self.digests.put(chunk, digest);
        self.particles.retain(|(of, _)| *of != chunk);
        self.particles.push_back((chunk, snapshots));
        if self.particles.len() > CHUNKS_KEPT_MAX {
            self.particles.pop_front();
        }
        Ok(())
    }

    fn particles_of(
        &mut self,
        chunk: usize,
        step: u64,
    ) -> Result<Option<Arc<Vec<ParticleState>>>, ReadError> {
        if !self.particles.iter().any(|(of, _)| *of == chunk) {
            self.read(chunk)?;
        }
        let snapshots = self.particles.iter().filter(|(of, _)| *of == chunk);
        let mut found = snapshots.flat_map(|(_, all)| all).filter(|(of, _)| *of == step);
        Ok(found.next().map(|(_, particles)| Arc::clone(particles)))
    }

    /// The header of a snapshot; it stands right before it, maybe in the chunk before.
    fn row_of(&mut self, chunk: usize, step: u64) -> Result<Option<StepRow>, ReadError> {
        for chunk in [Some(chunk), chunk.checked_sub(1)].into_iter().flatten() {
            if let Some(row) = self.digest(chunk)?.row(step) {
                return Ok(Some(row));
            }
        }
        Ok(None)
    }

    /// What is torn at a step of a chunk: from the newest keyframe before it, and what tore since.
    fn torn_at(&mut self, chunk: usize, step: u64) -> Result<Torn, ReadError> {
        let (first_chunk, mut follower) = self.torn_base(chunk, step)?;
        // One more: a round of the recorder may have written what comes after a keyframe before it.
        let changing = self.chunks.of_changes().from(first_chunk.saturating_sub(1));
        for chunk in changing.take_while(|one| *one <= chunk) {
            for change in self.digest(chunk)?.changes.clone() {
                follower.take_change(change);
            }
        }
        Ok(follower.at(step).cloned().unwrap_or_default())
    }

    /// Where to begin with what is torn: a keyframe, or the beginning of the file.
    fn torn_base(&mut self, chunk: usize, step: u64) -> Result<(usize, TornFollower), ReadError> {
        let from_the_beginning = TornFollower::new(Torn::before(&self.topology.torn));
        for chunk in self.chunks.of(Topic::Keyframe).back_from(chunk) {
            match self.digest(chunk)?.keyframe(step) {
                Some((of, Some(tears))) => {
                    return Ok((chunk, TornFollower::from_keyframe(*of, tears.clone())));
                }
                // Of another version, as all others will be.
                Some((_, None)) => return Ok((0, from_the_beginning)),
                None => {}
            }
        }
        Ok((0, from_the_beginning))
    }

    /// The newest of a topic that `pick` takes, up to a chunk.
    fn latest<T>(
        &mut self,
        topic: Topic,
        chunk: usize,
        pick: impl Fn(&Digest) -> Option<T>,
    ) -> Result<Option<T>, ReadError> {
        for chunk in self.chunks.of(topic).back_from(chunk) {
            if let Some(found) = pick(self.digest(chunk)?) {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }
}
