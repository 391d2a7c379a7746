//! The bytes of a recording that several readers share, in a file or in memory.

use std::fmt::Debug;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

/// Bytes that are read at any position: a file (with the feature `files`), or a `Vec<u8>`.
pub trait ReadAt: Debug + Send + Sync {
    /// Reads bytes from a position on. Returns their number: 0 at the end, else possibly fewer than asked for.
    ///
    /// # Errors
    /// If the bytes cannot be read.
    fn read_at(&self, buffer: &mut [u8], position: u64) -> io::Result<usize>;

    /// Returns the number of bytes.
    ///
    /// # Errors
    /// If the number cannot be read.
    fn size_bytes(&self) -> io::Result<u64>;
}

impl ReadAt for Vec<u8> {
    fn read_at(&self, buffer: &mut [u8], position: u64) -> io::Result<usize> {
        let start = usize::try_from(position).unwrap_or(usize::MAX).min(self.len());
        (&self[start..]).read(buffer)
    }

    fn size_bytes(&self) -> io::Result<u64> {
        Ok(self.len() as u64)
    }
}

/// A file that several readers share, each with a position of its own.
#[derive(Debug, Clone)]
pub struct FileSource {
    bytes: Arc<dyn ReadAt>,
    position: u64,
}

impl FileSource {
    /// Returns a reader of the same file from a position on.
    pub(super) fn at(&self, position: u64) -> Self {
        Self { bytes: Arc::clone(&self.bytes), position }
    }
}

impl<T: ReadAt + 'static> From<Arc<T>> for FileSource {
    /// Begins at the start of the file.
    fn from(bytes: Arc<T>) -> Self {
        Self { bytes, position: 0 }
    }
}

impl Read for FileSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read_at(buffer, self.position)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for FileSource {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
            SeekFrom::End(offset) => self.bytes.size_bytes()?.checked_add_signed(offset),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}
