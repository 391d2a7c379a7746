//! The writing thread: writes the queue into one file after the other.

pub(crate) mod black_box;
pub(crate) mod extras;
pub(crate) mod names;

use std::collections::VecDeque;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, anyhow};
use recording::{
    Closing, ContentSelection, LogOptions, LogWriter, Message, PartFile, ParticleBuffer, WriteError,
};
use sim_host::clock::monotonic_ns;

use super::queue::{Content, Entry, FileEnd, Item, Queue};
use super::report::Written;
use super::split::{Ring, WritePosition};
use super::start::RunHeader;
use crate::cli::args::{FileArgs, LogFile};
use crate::cli::output;
use black_box::{BlackBox, KeptFile};
use extras::Extras;
use names::FileNames;

/// Longest time that an item waits for others, which are written together.
const WAIT_MAX: Duration = Duration::from_millis(50);

/// The writing of files.
#[derive(Debug)]
pub(crate) struct WriteOptions {
    pub(crate) file: FileArgs,
    pub(crate) names: FileNames,
    pub(crate) extras: Extras,
    pub(crate) selection: ContentSelection,
    pub(crate) ring: Ring,
    /// Files of the ring from before this recording, oldest first.
    pub(crate) earlier: Vec<PathBuf>,
    /// Every flush waits until the data is on the disk.
    pub(crate) is_synced: bool,
    /// The most that a killed recorder or a power cut loses, besides the open chunk.
    pub(crate) flush_interval: Duration,
    /// Keeps everything until a file is to be written.
    pub(crate) black_box: Option<BlackBox>,
}

impl WriteOptions {
    /// Creates a file, with the suffix `.part`.
    pub(crate) fn create(&self, number: u64) -> anyhow::Result<PartFile> {
        let file = self.file.create(&self.names.path(number))?;
        Ok(if self.is_synced { file.with_sync_on_flush() } else { file })
    }
}

/// Closes the queue when the writing thread ends for any reason, so that the reading thread sees it.
struct CloseOnDrop(Arc<Queue>);

impl Drop for CloseOnDrop {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Starts the writing thread, which ends with the queue. `first` is the first file.
pub(crate) fn start(
    queue: Arc<Queue>,
    position: Arc<WritePosition>,
    options: WriteOptions,
    first: Option<PartFile>,
) -> anyhow::Result<JoinHandle<anyhow::Result<Written>>> {
    let queue = CloseOnDrop(queue);
    let writing = thread::Builder::new().name("writer".to_owned()).spawn(move || {
        let mut files = Writer::new(options, position, first);
        files.write_all(&queue.0)?;
        files.close()
    });
    writing.context("cannot start the writing thread")
}

/// The files of a recording.
#[derive(Debug)]
struct Writer {
    options: WriteOptions,
    position: Arc<WritePosition>,
    /// The first file, until it begins.
    created: Option<PartFile>,
    open: Option<OpenFile>,
    next_number: u64,
    /// The files of the ring, oldest first. The last one is in progress.
    ring: VecDeque<PathBuf>,
    written: Written,
}

/// The file that is being written.
#[derive(Debug)]
struct OpenFile {
    number: u64,
    part_path: PathBuf,
    log: LogFile,
    /// First and last recorded step.
    steps: Option<(u64, u64)>,
}

impl Writer {
    fn new(
        mut options: WriteOptions,
        position: Arc<WritePosition>,
        created: Option<PartFile>,
    ) -> Self {
        let ring = std::mem::take(&mut options.earlier).into();
        let written = Written::default();
        Self { options, position, created, open: None, next_number: 0, ring, written }
    }

    /// Writes every entry of the queue, and flushes at intervals.
    fn write_all(&mut self, queue: &Queue) -> anyhow::Result<()> {
        let interval_ns = self.options.flush_interval.as_nanos();
        let interval_ns = u64::try_from(interval_ns).unwrap_or(u64::MAX);
        let mut next_flush_ns = monotonic_ns().saturating_add(interval_ns);
        loop {
            let until_flush = next_flush_ns.saturating_sub(monotonic_ns());
            let Some(count) = queue.wait(WAIT_MAX.min(Duration::from_nanos(until_flush))) else {
                return Ok(());
            };
            for entry in std::iter::from_fn(|| queue.pop()).take(count) {
                self.on_entry(entry, queue)?;
            }
            // After everything that waited, so that all of it is flushed.
            let now_ns = monotonic_ns();
            if now_ns >= next_flush_ns {
                next_flush_ns = now_ns.saturating_add(interval_ns);
                self.flush()?;
            }
        }
    }

    fn on_entry(&mut self, entry: Entry, queue: &Queue) -> anyhow::Result<()> {
        match entry {
            Entry::Begin { header, log_time_ns } => self.on_begin(header, log_time_ns),
            Entry::Item(item) => {
                self.on_item(item)?;
                while let Some(buffer) = self.take_spare() {
                    queue.add_spare(buffer);
                }
                Ok(())
            }
            Entry::End(closing, end) => self.on_end(*closing, end),
        }
    }

    fn on_begin(&mut self, header: Box<RunHeader>, log_time_ns: u64) -> anyhow::Result<()> {
        match &mut self.options.black_box {
            Some(black_box) => black_box.begin(header, log_time_ns, monotonic_ns()),
            None => self.begin(&header, log_time_ns)?,
        }
        Ok(())
    }

    /// Returns the buffer of a snapshot that is written.
    fn take_spare(&mut self) -> Option<ParticleBuffer> {
        self.open.as_mut().and_then(|open| open.log.take_spare())
    }

    fn on_item(&mut self, item: Item) -> anyhow::Result<()> {
        let Some(black_box) = &mut self.options.black_box else { return self.write(item) };
        black_box.push(item);
        self.position.set(self.next_number, black_box.size_bytes() as u64);
        Ok(())
    }

    fn on_end(&mut self, closing: Closing, end: FileEnd) -> anyhow::Result<()> {
        let Some(black_box) = &mut self.options.black_box else { return self.finish(closing) };
        black_box.end(closing, end, monotonic_ns()).map_or(Ok(()), |file| self.write_kept(file))
    }

    /// Writes a file of the black box.
    fn write_kept(&mut self, file: KeptFile) -> anyhow::Result<()> {
        self.begin(&file.header, file.log_time_ns)?;
        file.items.into_iter().try_for_each(|item| self.write(item))?;
        self.finish(file.closing)
    }

    /// Begins the next file. In a ring, removes the oldest files after creating this one.
    fn begin(&mut self, header: &RunHeader, log_time_ns: u64) -> anyhow::Result<()> {
        let number = self.next_number;
        self.next_number += 1;
        let file = self.created.take().map_or_else(|| self.options.create(number), Ok)?;
        let part_path = file.part_path().to_owned();
        let log_options =
            LogOptions { selection: self.options.selection, ..self.options.file.options() };
        let log = LogWriter::create(file, log_options, &header.run, &header.scene, log_time_ns);
        let mut log = log.with_context(|| incomplete(&part_path))?;
        log.describe_colliders(&header.colliders).with_context(|| incomplete(&part_path))?;
        self.options.extras.write(&mut log).with_context(|| incomplete(&part_path))?;
        self.position.set(number, log.size_bytes());
        self.open = Some(OpenFile { number, part_path, log, steps: None });
        self.trim_ring(number);
        Ok(())
    }

    /// Adds a file to the ring of a recording that has one, and removes the oldest files beyond the limit of the ring.
    fn trim_ring(&mut self, number: u64) {
        let ring = self.options.ring;
        if ring.is_given() && !self.options.names.is_single() {
            self.ring.push_back(self.options.names.path(number));
        }
        let count_max = ring.files_max.and_then(|count| usize::try_from(count).ok());
        while self.ring.len() > count_max.unwrap_or(usize::MAX) {
            self.remove_oldest();
        }
        self.keep_reserve();
    }

    /// If less than the reserve is free, removes the oldest file of a ring, but not the file in progress, or ends the
    /// recording of a single file. Each call removes at most one file, because some file systems show its space as
    /// free only seconds later.
    fn keep_reserve(&mut self) {
        let names = &self.options.names;
        if !self.options.ring.is_short(&names.path(0)) {
            return;
        }
        if names.is_single() {
            self.position.end_for_reserve();
            return;
        }
        while self.ring.len() > 1 {
            let path = output::path_text(&self.ring[0]);
            output::note(&format!("removing {path}, because less than --min-free is free"));
            if self.remove_oldest() {
                return;
            }
        }
    }

    /// Removes the oldest file of the ring, unless another program has moved it. If the file cannot be removed, it
    /// stays and the recording goes on, because the newest data matter most. Returns `true` if a file was removed.
    fn remove_oldest(&mut self) -> bool {
        let Some(path) = self.ring.pop_front() else { return false };
        match fs::remove_file(&path) {
            Ok(()) => {
                self.written.removed_count += 1;
                return true;
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => output::note(&format!(
                "warning: cannot remove {} ({error}); it stays, and takes space beside the files of the ring",
                output::path_text(&path)
            )),
        }
        false
    }

    fn write(&mut self, item: Item) -> anyhow::Result<()> {
        let Some(open) = &mut self.open else { return Ok(()) };
        if let Content::Snapshot(row, _) | Content::Update(Message::Step(row)) = &item.content {
            open.steps = Some((open.steps.map_or(row.step, |(first, _)| first), row.step));
        }
        write_item(&mut open.log, item).with_context(|| incomplete(&open.part_path))?;
        self.position.set(open.number, open.log.size_bytes());
        Ok(())
    }

    fn flush(&mut self) -> anyhow::Result<()> {
        self.keep_reserve();
        let Some(open) = &mut self.open else { return Ok(()) };
        open.log.flush().with_context(|| incomplete(&open.part_path))?;
        self.position.set(open.number, open.log.size_bytes());
        Ok(())
    }

    /// Writes the end of the file, and gives it its name.
    fn finish(&mut self, mut closing: Closing) -> anyhow::Result<()> {
        let Some(OpenFile { part_path, log, steps, .. }) = self.open.take() else {
            return Ok(());
        };
        closing.counts.set_written(log.counts());
        let kept = || {
            let part = output::path_text(&part_path);
            format!("the recording is complete except for its end, in {part}")
        };
        let file = log.finish(&closing).with_context(kept)?;
        let path = file.finish().map_err(|error| {
            let is_complete = error.leaves_complete_file();
            if is_complete { anyhow!(error) } else { anyhow!(error).context(kept()) }
        })?;
        if !self.options.names.is_single() {
            output::note(&Written::file_line(&path, &closing, steps));
        }
        self.written.add(path, &closing, steps);
        Ok(())
    }

    /// Ends the thread. Removes a file that has not begun.
    fn close(self) -> anyhow::Result<Written> {
        if let Some(file) = self.created {
            file.discard()?;
        }
        Ok(self.written)
    }
}

fn incomplete(part_path: &Path) -> String {
    output::incomplete("the recording", part_path)
}

/// Writes the messages of an item.
pub(super) fn write_item<W: Write>(log: &mut LogWriter<W>, item: Item) -> Result<(), WriteError> {
    let Item { content, log_time_ns } = item;
    match content {
        Content::Update(message) => log.write(&message, log_time_ns),
        Content::Snapshot(row, buffer) => {
            log.write(&Message::Step(row), log_time_ns)?;
            log.write_particles(row.step, buffer, log_time_ns)
        }
    }
}

#[cfg(test)]
mod tests;
