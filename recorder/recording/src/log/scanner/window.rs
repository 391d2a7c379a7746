//! A file as a window that moves forward over its bytes.

use std::io::{self, Read, Seek, SeekFrom};

use sim_messages::StopFlag;

use crate::log::read_error::{ReadError, check_stop};

/// Bytes to read at a time. Memory grows only with bytes that the file has, and a signal is noticed
/// between two reads and before each record.
const READ_SIZE_BYTES: usize = 1 << 20;

/// The bytes of a file around the current record.
pub(in crate::log) struct Window<R> {
    source: R,
    /// Goes to a byte of the source. `None` for a source that is read in order.
    seek: Option<fn(&mut R, SeekFrom) -> io::Result<u64>>,
    /// `u64::MAX` if the file is read up to the end that it then has.
    size_bytes: u64,
    /// Position of the first byte in memory.
    start: u64,
    bytes: Vec<u8>,
    /// Bytes to read beyond those that are needed.
    ahead_size_bytes: usize,
    /// `None` if the program does not handle signals.
    stop: Option<StopFlag>,
}

impl<R: Read> Window<R> {
    /// Reads a source in order, up to its end.
    pub(in crate::log) fn in_order(source: R) -> Self {
        Self {
            source,
            seek: None,
            size_bytes: u64::MAX,
            start: 0,
            bytes: Vec::new(),
            ahead_size_bytes: READ_SIZE_BYTES,
            stop: None,
        }
    }

    /// Returns the size of the file when it was opened, or `u64::MAX` if it is unknown.
    pub(in crate::log) fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// Returns an error after a signal.
    pub(in crate::log) fn check_stop(&self) -> Result<(), ReadError> {
        Ok(check_stop(self.stop.as_ref())?)
    }

    /// Returns the bytes from a position on: `size_bytes`, or fewer at the end of the file.
    pub(in crate::log) fn bytes(&mut self, at: u64, size_bytes: usize) -> Result<&[u8], ReadError> {
        let left = usize::try_from(self.size_bytes.saturating_sub(at)).unwrap_or(usize::MAX);
        let size_bytes = left.min(size_bytes);
        let offset = self.offset(at).filter(|offset| offset + size_bytes <= self.bytes.len());
        let offset = match offset {
            Some(offset) => offset,
            // Beyond what is needed now, so that many positions close together need few reads.
            None => self.load(at, left.min(size_bytes.saturating_add(self.ahead_size_bytes)))?,
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
            None if self.seek.is_none() => {
                let what = "a source that is read in order has no earlier or later bytes";
                return Err(ReadError::Io(io::Error::other(what)));
            }
            None => self.bytes.clear(),
        }
        self.start = at;
        if let Some(seek) = self.seek {
            seek(&mut self.source, SeekFrom::Start(at + self.bytes.len() as u64))?;
        }
        while self.bytes.len() < size_bytes {
            check_stop(self.stop.as_ref())?;
            let count = (size_bytes - self.bytes.len()).min(READ_SIZE_BYTES) as u64;
            if self.source.by_ref().take(count).read_to_end(&mut self.bytes)? == 0 {
                break;
            }
        }
        Ok(0)
    }
}

impl<R: Read + Seek> Window<R> {
    /// Reads a file up to the end that it has now.
    pub(in crate::log) fn new(mut source: R, stop: Option<StopFlag>) -> Result<Self, ReadError> {
        let size_bytes = source.seek(SeekFrom::End(0))?;
        Ok(Self { size_bytes, ..Self::growing(source, stop) })
    }

    /// Reads a file up to the end that it has then.
    pub(in crate::log) fn growing(source: R, stop: Option<StopFlag>) -> Self {
        Self { seek: Some(R::seek), stop, ..Self::in_order(source) }
    }

    /// Reads no more than is needed and a few kilobytes, for records far apart.
    pub(in crate::log) fn reading_little_ahead(self) -> Self {
        Self { ahead_size_bytes: 1 << 13, ..self }
    }
}
