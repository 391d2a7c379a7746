//! A file as a window that moves forward over its bytes.

use std::io::{Read, Seek, SeekFrom};

use sim_contract::Stop;

use crate::log::read::file_source::check_stop;
use crate::log::read::read_error::ReadError;

/// Bytes to read at a time. Memory grows only with bytes that the file has, and a signal is noticed
/// between two reads and before each record.
const READ_SIZE_BYTES: usize = 4 << 20;

/// The bytes of a file around the current record.
pub(super) struct Window<R> {
    source: R,
    size_bytes: u64,
    /// Position of the first byte in memory.
    start: u64,
    bytes: Vec<u8>,
    /// `None` if the program does not handle signals.
    stop: Option<Stop>,
}

impl<R: Read + Seek> Window<R> {
    pub(super) fn new(mut source: R, stop: Option<Stop>) -> Result<Self, ReadError> {
        let size_bytes = source.seek(SeekFrom::End(0))?;
        source.seek(SeekFrom::Start(0))?;
        Ok(Self { source, size_bytes, start: 0, bytes: Vec::new(), stop })
    }

    /// Returns the size of the file when it was opened. A file that grows is read up to there.
    pub(super) fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// Returns an error after a signal.
    pub(super) fn check_stop(&self) -> Result<(), ReadError> {
        Ok(check_stop(self.stop.as_ref())?)
    }

    /// Returns the bytes from a position on: `size_bytes`, or fewer at the end of the file.
    pub(super) fn bytes(&mut self, at: u64, size_bytes: usize) -> Result<&[u8], ReadError> {
        let left = self.size_bytes.saturating_sub(at);
        let size_bytes = usize::try_from(left).unwrap_or(usize::MAX).min(size_bytes);
        let offset = self.offset(at).filter(|offset| offset + size_bytes <= self.bytes.len());
        let offset = match offset {
            Some(offset) => offset,
            None => self.load(at, size_bytes)?,
        };
        let end = self.bytes.len().min(offset + size_bytes);
        Ok(&self.bytes[offset.min(end)..end])
    }

    /// Returns the place of a position in memory.
    fn offset(&self, at: u64) -> Option<usize> {
        let offset = usize::try_from(at.checked_sub(self.start)?).ok()?;
        (offset <= self.bytes.len()).then_some(offset)
    }

    /// Moves the window to a position.
    fn load(&mut self, at: u64, size_bytes: usize) -> Result<usize, ReadError> {
        match self.offset(at) {
            Some(offset) => drop(self.bytes.drain(..offset)),
            None => self.bytes.clear(),
        }
        self.start = at;
        self.source.seek(SeekFrom::Start(at + self.bytes.len() as u64))?;
        let end = (self.size_bytes - at.min(self.size_bytes)).min(usize::MAX as u64);
        // Beyond what is needed now, so that many positions close together need few reads.
        let wanted = size_bytes
            .saturating_add(READ_SIZE_BYTES)
            .min(usize::try_from(end).unwrap_or(usize::MAX));
        while self.bytes.len() < wanted {
            check_stop(self.stop.as_ref())?;
            let count = (wanted - self.bytes.len()).min(READ_SIZE_BYTES) as u64;
            if self.source.by_ref().take(count).read_to_end(&mut self.bytes)? == 0 {
                break;
            }
        }
        Ok(0)
    }
}
