//! Reads a recording on a thread of its own, while another thread simulates.

use std::io::{self, Read};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Builder, Scope};
use std::vec;

use sim_contract::ParticleState;

use crate::log::{
    AuditDifference, Closing, Frame, FrameReader, LogEnd, LogReader, ReadError, Topic,
};

use crate::simulation::frozen::FrozenParticles;

/// Size at which a batch is passed on, in bytes. Handing over a batch takes some microseconds, which is
/// longer than a step of a small scene.
const BATCH_SIZE_BYTES: usize = 1 << 18;
/// Most batches that wait: enough for the snapshots of a chunk of 1 MiB, which are decompressed at once.
const BATCHES_MAX: usize = 8;

/// A snapshot and what the reading thread has found in it.
#[derive(Debug)]
pub(super) struct ReadFrame {
    pub(super) frame: Frame,
    /// `None` without particles.
    pub(super) frozen: Option<FrozenParticles>,
}

/// The findings in the file up to a snapshot.
#[derive(Debug)]
pub(super) struct Seen {
    /// Number of bytes that are read and intact.
    pub(super) intact_count: u64,
    /// The end of the file, once it is reached.
    pub(super) end: Option<LogEnd>,
    /// The closing metadata, once they are read.
    pub(super) closing: Option<Box<Closing>>,
    /// The first part that a recorder would not write so.
    pub(super) difference: Option<AuditDifference>,
    /// A topic that the format of the file does not have yet.
    pub(super) newer_topic: Option<Topic>,
    /// Names of content of other programs.
    pub(super) foreign: Vec<String>,
    /// Names of attached meshes.
    pub(super) mesh_files: Vec<String>,
    /// Number of messages that no snapshot follows yet.
    pub(super) trailing_count: usize,
}

impl Seen {
    fn new<R: Read>(frames: &FrameReader<R>) -> Self {
        let log = frames.log();
        let foreign = log.audit().into_iter().flat_map(crate::log::Audit::foreign);
        let mesh_files = log.audit().into_iter().flat_map(crate::log::Audit::mesh_files);
        let trailing_row = usize::from(frames.trailing_row().is_some());
        Self {
            intact_count: log.intact_count(),
            end: log.end().cloned(),
            closing: log.closing().cloned().map(Box::new),
            difference: log.audit().and_then(|audit| audit.difference().cloned()),
            newer_topic: log.newer_topic(),
            foreign: foreign.map(ToOwned::to_owned).collect(),
            mesh_files: mesh_files.map(ToOwned::to_owned).collect(),
            trailing_count: frames.trailing_updates().len() + trailing_row,
        }
    }
}

/// The result of reading one snapshot. `Ok(None)` and errors are the last one.
type Reading = (Result<Option<ReadFrame>, ReadError>, Seen);

/// The snapshots of a recording, which a thread reads ahead. The thread ends when this is dropped.
#[derive(Debug)]
pub(super) struct ReadAhead {
    batches: Receiver<Vec<Reading>>,
    batch: vec::IntoIter<Reading>,
    /// Takes the memory of particles back. To allocate it for each snapshot would take longer than to read it.
    spare: Sender<Vec<ParticleState>>,
    /// As of the last snapshot that [`Self::next_frame`] has returned, or of the header.
    pub(super) seen: Seen,
}

impl ReadAhead {
    /// Starts the thread.
    pub(super) fn start<'scope, R: Read + Send + 'scope>(
        threads: &'scope Scope<'scope, '_>,
        log: LogReader<R>,
    ) -> io::Result<Self> {
        let frames = FrameReader::new(log);
        let seen = Seen::new(&frames);
        let (sender, batches) = sync_channel(BATCHES_MAX);
        let (spare, spares) = channel();
        let thread = Builder::new().name("read".to_owned());
        thread.spawn_scoped(threads, move || read_all(frames, &sender, &spares))?;
        Ok(Self { batches, batch: Vec::new().into_iter(), spare, seen })
    }

    /// Returns the next snapshot, or `None` at the end of the readable part.
    ///
    /// # Errors
    /// Like [`FrameReader::next_frame`].
    pub(super) fn next_frame(&mut self) -> Result<Option<ReadFrame>, ReadError> {
        if self.batch.as_slice().is_empty() {
            // After the last batch, the thread has ended.
            self.batch = self.batches.recv().unwrap_or_default().into_iter();
        }
        let Some((result, seen)) = self.batch.next() else { return Ok(None) };
        self.seen = seen;
        result
    }

    /// Takes a snapshot that is no longer needed.
    pub(super) fn give_back(&self, frame: Frame) {
        if let Some(particles) = frame.particles {
            // After the last batch, the thread has ended and needs no memory.
            let _ended = self.spare.send(particles);
        }
    }
}

/// Reads up to the end of the file, or until nobody receives the batches.
fn read_all<R: Read>(
    mut frames: FrameReader<R>,
    batches: &SyncSender<Vec<Reading>>,
    spares: &Receiver<Vec<ParticleState>>,
) {
    let mut is_at_end = false;
    while !is_at_end {
        let mut batch = Vec::new();
        let mut size_bytes = 0;
        for particles in spares.try_iter() {
            frames.add_spare(particles);
        }
        while size_bytes < BATCH_SIZE_BYTES && !is_at_end {
            let result = frames.next_frame();
            is_at_end = !matches!(result, Ok(Some(_)));
            let result = result.map(|frame| frame.map(ReadFrame::new));
            size_bytes += size_of::<Reading>();
            if let Ok(Some(read)) = &result {
                size_bytes += read.frame.size_bytes();
            }
            batch.push((result, Seen::new(&frames)));
        }
        if batches.send(batch).is_err() {
            return;
        }
    }
}

impl ReadFrame {
    fn new(frame: Frame) -> Self {
        let frozen = frame.particles.as_deref().map(FrozenParticles::find);
        Self { frame, frozen }
    }
}
