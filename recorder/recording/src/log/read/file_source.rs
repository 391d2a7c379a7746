//! A file that is read until a signal arrives.

use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::os::unix::fs::FileExt;
use std::sync::Arc;

use sim_contract::Stop;

/// Bytes that the file is read ahead.
const BUFFER_SIZE_BYTES: usize = 1 << 20;

/// A file that is read until a signal arrives.
#[derive(Debug)]
pub struct FileSource {
    file: BufReader<SharedFile>,
    /// `None` if the program does not handle signals.
    stop: Option<Stop>,
}

/// A file that several readers share, each with a position of its own.
#[derive(Debug)]
pub struct SharedFile {
    file: Arc<File>,
    position: u64,
}

impl SharedFile {
    /// Begins at the start of the file.
    pub fn new(file: Arc<File>) -> Self {
        Self { file, position: 0 }
    }
}

impl Read for SharedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read_at(buffer, self.position)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
            SeekFrom::End(offset) => self.file.metadata()?.len().checked_add_signed(offset),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

/// The content of the error of a read after a signal.
#[derive(Debug)]
pub(super) struct Interrupted;

impl fmt::Display for Interrupted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("interrupted")
    }
}

impl std::error::Error for Interrupted {}

impl FileSource {
    pub(super) fn new(file: Arc<File>, stop: Option<Stop>) -> Self {
        Self { file: BufReader::with_capacity(BUFFER_SIZE_BYTES, SharedFile::new(file)), stop }
    }

    /// Continues at a byte of the file.
    pub(super) fn go_to(&mut self, byte: u64) {
        let file = Arc::clone(&self.file.get_ref().file);
        let file = SharedFile { file, position: byte };
        self.file = BufReader::with_capacity(BUFFER_SIZE_BYTES, file);
    }
}

impl Read for FileSource {
    /// Checks for a signal in each call, not in each read from the disk: a few bytes of a compressed
    /// file can take seconds to process.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        check_stop(self.stop.as_ref())?;
        self.file.read(buffer)
    }
}

/// Returns an error after a signal.
pub(in crate::log) fn check_stop(stop: Option<&Stop>) -> io::Result<()> {
    match stop {
        Some(stop) if stop.is_requested() => Err(io::Error::other(Interrupted)),
        _ => Ok(()),
    }
}
