//! A recording as a tape that winds to any step. It reads only the chunks around the step.

mod chunk_reader;
mod search;

use sim_messages::{StopFlag, Torn};

use super::index::IndexedLog;
use super::message::Message;
use super::read::frames::FrameReader;
use super::read_error::{LogEnd, ReadError};
use super::rows::{ForcesRow, StepRow, SurfaceRow, TopologyRow};
use super::run::RunDescription;
use super::source::FileSource;
use super::state::RecordedState;
use super::tears::TearChange;
use super::topic::Topic;
use chunk_reader::ChunkReader;
use search::{RecordedSteps, SnapshotPosition, find, first_and_last};

/// The reason why a recording cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum TapeError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The file has no readable snapshot.
    #[error("has no snapshot to show (the file is {0})")]
    NoSnapshot(LogEnd),
    /// The file has no readable constraints or triangles.
    #[error("has no readable {topic} before its first snapshot")]
    NoLoad {
        /// Name of the topic that it lacks.
        topic: &'static str,
        /// A chunk that cannot be read, or the end of the file, explains it.
        is_damaged: bool,
    },
}

/// A recording that winds to any step.
#[derive(Debug)]
pub struct Tape {
    reader: ChunkReader,
    topology: TopologyRow,
    surface: SurfaceRow,
    range: RecordedSteps,
    stride: u64,
}

/// Torn constraints to start from.
struct TornBase {
    /// The changes from this chunk on follow.
    chunk: usize,
    /// The step of the torn constraints. `None` for those before the file.
    step: Option<u64>,
    torn: Torn,
}

impl Tape {
    /// Reads a file that other readers may share. A scan of a file without an index calls `on_progress` with the bytes
    /// scanned and the size of the file. After a signal, this and every later read ends with
    /// [`ReadError::Interrupted`].
    ///
    /// # Errors
    /// If the file is not a recording or has no snapshot.
    pub fn of_file(
        file: impl Into<FileSource>,
        stop: Option<&StopFlag>,
        on_progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Self, TapeError> {
        let mut log = IndexedLog::of_file(file, stop, on_progress)?;
        let load = read_load(&mut log)?;
        let is_damaged = load.has_damage || *log.end() != LogEnd::Complete;
        let missing = |topic| TapeError::NoLoad { topic, is_damaged };
        let topology = load.topology.ok_or_else(|| missing("/topology"))?;
        let surface = load.surface.ok_or_else(|| missing("/surface"))?;
        let mut reader = ChunkReader::new(log);
        let ends = first_and_last(&mut reader)?;
        let (first_steps, last) =
            ends.ok_or_else(|| TapeError::NoSnapshot(reader.log().end().clone()))?;
        let range = RecordedSteps { first: first_steps[0], last: last.max(first_steps[0]) };
        let mut tape = Self { reader, topology, surface, range, stride: 1 };
        // The second snapshot may be in the next chunk.
        let second = tape.step_after(range.first)?;
        let pairs = first_steps.windows(2).map(|pair| pair[1].saturating_sub(pair[0]));
        let strides = pairs.chain([second.saturating_sub(range.first)]);
        tape.stride = strides.filter(|stride| *stride > 0).min().unwrap_or(1);
        Ok(tape)
    }

    /// Returns the run that was recorded.
    pub fn run(&self) -> &RunDescription {
        self.log().run()
    }

    /// Returns the file, with access to its chunks.
    pub fn log(&self) -> &IndexedLog {
        self.reader.log()
    }

    /// Returns the constraints.
    pub fn topology(&self) -> &TopologyRow {
        &self.topology
    }

    /// Returns the triangles.
    pub fn surface(&self) -> &SurfaceRow {
        &self.surface
    }

    /// Returns the first recorded step.
    pub fn first_step(&self) -> u64 {
        self.range.first
    }

    /// Returns the last recorded step.
    pub fn last_step(&self) -> u64 {
        self.range.last
    }

    /// Returns the number of steps between consecutive snapshots, where none is missing.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Returns the read errors since the last call, as text for users. A chunk reports its errors
    /// once, even if it is read again.
    pub fn drain_faults(&mut self) -> Vec<String> {
        self.reader.drain_faults()
    }

    /// Returns the last recorded step up to `step`, or else the first recorded step.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn step_at(&mut self, step: u64) -> Result<u64, ReadError> {
        let step = step.clamp(self.range.first, self.range.last);
        Ok(self.find(step)?.map_or(self.range.first, |position| position.step))
    }

    /// Returns the next recorded step after `step`, or `step` if it is the last one.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn step_after(&mut self, step: u64) -> Result<u64, ReadError> {
        let Some(position) = self.find(step)? else { return Ok(self.range.first) };
        for chunk in self.reader.chunks.with_topic(Topic::Particles).forward_from(position.chunk) {
            let snapshots = &self.reader.digest(chunk)?.snapshots;
            if let Some(next) = snapshots.iter().find(|one| **one > step) {
                return Ok(*next);
            }
        }
        Ok(step)
    }

    /// Returns the state of the last recorded step up to `step`.
    ///
    /// # Errors
    /// If the operating system reports an error or the snapshot has become unreadable.
    pub fn state_at(&mut self, step: u64) -> Result<RecordedState, TapeError> {
        let step = step.clamp(self.range.first, self.range.last);
        let missing = || TapeError::NoSnapshot(LogEnd::Complete);
        let SnapshotPosition { chunk, step } = self.find(step)?.ok_or_else(missing)?;
        let particles = self.reader.particles(chunk, step)?.ok_or_else(missing)?;
        let row = self.row(chunk, step)?;
        let mut torn = self.torn_at(chunk, step)?;
        if let Some(row) = &row {
            torn.truncate(row.torn_count);
            torn.header.since_step = row.step.saturating_sub(row.scene_step);
        }
        let has_readable_row = row.is_some();
        let row = row.unwrap_or(StepRow { step, ..StepRow::default() });
        let colliders = self.reader.latest(Topic::Colliders, chunk, |digest| {
            digest.colliders.iter().rfind(|row| row.step <= step).cloned()
        })?;
        let parameters = self.reader.latest(Topic::Parameters, chunk, |digest| {
            digest.parameters.iter().rfind(|row| row.step <= step).cloned()
        })?;
        let status = self.reader.latest(Topic::Status, chunk, |digest| {
            digest.statuses.iter().rfind(|row| row.step <= step).cloned()
        })?;
        Ok(RecordedState {
            row,
            has_readable_row,
            particles,
            torn,
            colliders,
            parameters,
            rejected_count: status.as_ref().map_or(0, |row| row.rejected_count),
            status,
            ..RecordedState::default()
        })
    }

    /// Returns the forces of a recorded step. `None` if the file has none of it: it was recorded without them, or no
    /// step has led to its state.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn forces_at(&mut self, step: u64) -> Result<Option<ForcesRow>, ReadError> {
        let Some(position) = self.find(step)? else { return Ok(None) };
        // They precede the snapshot, possibly in an earlier chunk.
        let chunks = self.reader.chunks.with_topic(Topic::Forces).backward_from(position.chunk);
        for chunk in chunks.take(2) {
            if let Some(row) = self.reader.forces(chunk, step)? {
                return Ok(Some(row));
            }
        }
        Ok(None)
    }

    /// Returns the newest keyframe up to `step` and its step, as far as it is readable.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn keyframe_at(&mut self, step: u64) -> Result<Option<(u64, Vec<u8>)>, ReadError> {
        let Some(position) = self.find(step)? else { return Ok(None) };
        let chunks = self.reader.chunks.with_topic(Topic::Keyframe);
        for chunk in chunks.backward_from(position.chunk) {
            if self.reader.digest(chunk)?.keyframe(step).is_some() {
                return self.reader.keyframe(chunk, step);
            }
        }
        Ok(None)
    }

    /// Makes a reader of the same file continue after the snapshot of a recorded step. Its next frame has
    /// every message of later steps.
    ///
    /// # Errors
    /// If the operating system reports an error or the content of a message is invalid.
    pub fn wind(
        &mut self,
        frames: &mut FrameReader<FileSource>,
        step: u64,
    ) -> Result<(), ReadError> {
        let Some(SnapshotPosition { chunk, step }) = self.find(step)? else { return Ok(()) };
        frames.go_to(&self.log().chunk_start(chunk));
        frames.skip_to(step)
    }

    /// Makes a reader of the same file continue at the first message.
    pub fn rewind(&self, frames: &mut FrameReader<FileSource>) {
        // A tape has a snapshot, so there is a chunk.
        frames.go_to(&self.log().chunk_start(0));
    }

    fn find(&mut self, step: u64) -> Result<Option<SnapshotPosition>, ReadError> {
        find(&mut self.reader, step, self.range)
    }

    /// Returns the header of a snapshot. It precedes the snapshot, possibly in the previous chunk.
    fn row(&mut self, chunk: usize, step: u64) -> Result<Option<StepRow>, ReadError> {
        for chunk in [Some(chunk), chunk.checked_sub(1)].into_iter().flatten() {
            if let Some(row) = self.reader.digest(chunk)?.row(step) {
                return Ok(Some(row));
            }
        }
        Ok(None)
    }

    /// Returns the torn constraints at a step: those of the newest keyframe before it, and the
    /// tears since.
    fn torn_at(&mut self, chunk: usize, step: u64) -> Result<Torn, ReadError> {
        let base = self.torn_base(chunk, step)?;
        let mut torn = base.torn;
        let changes = self.reader.chunks.with_tear_changes().forward_from(base.chunk);
        for chunk in changes.take_while(|one| *one <= chunk) {
            let later = |one: &&TearChange| base.step.is_none_or(|step| one.step() > step);
            for change in self.reader.digest(chunk)?.changes.iter().filter(later) {
                if change.step() <= step {
                    change.apply(&mut torn);
                }
            }
        }
        Ok(torn)
    }

    /// Returns the torn constraints to start from: the list in the newest keyframe, or the constraints
    /// that were torn at the start of the file.
    fn torn_base(&mut self, chunk: usize, step: u64) -> Result<TornBase, ReadError> {
        let from_start = TornBase { chunk: 0, step: None, torn: self.topology.torn_before() };
        for chunk in self.reader.chunks.with_topic(Topic::Keyframe).backward_from(chunk) {
            match self.reader.digest(chunk)?.keyframe(step) {
                Some((step, Some(torn))) => {
                    return Ok(TornBase { chunk, step: Some(*step), torn: torn.clone() });
                }
                // A keyframe of another version. All keyframes of a file have the same version.
                Some((_, None)) => return Ok(from_start),
                None => {}
            }
        }
        Ok(from_start)
    }
}

/// The rows of a load, if the file has readable ones.
#[derive(Debug, Default)]
struct Load {
    topology: Option<TopologyRow>,
    surface: Option<SurfaceRow>,
    /// A chunk that may have had them cannot be read.
    has_damage: bool,
}

/// Reads the load. A file has one load, in its first chunks, before the first snapshot.
fn read_load(log: &mut IndexedLog) -> Result<Load, ReadError> {
    let mut load = Load::default();
    for chunk in 0..log.chunks().len() {
        if load.topology.is_some() && load.surface.is_some() {
            break;
        }
        if !log.chunks()[chunk].has_any(&[Topic::Topology, Topic::Surface]) {
            continue;
        }
        let messages = match log.read_chunk(chunk) {
            Err(ReadError::DamagedChunk { .. } | ReadError::Malformed { .. }) => {
                load.has_damage = true;
                continue;
            }
            read => read?,
        };
        for logged in messages {
            match logged.message {
                Message::Topology(row) => _ = load.topology.get_or_insert(row),
                Message::Surface(row) => _ = load.surface.get_or_insert(row),
                _ => {}
            }
        }
    }
    Ok(load)
}
