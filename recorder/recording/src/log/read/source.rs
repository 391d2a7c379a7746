//! The bytes of a file, with their position and their checksum.

use std::io::{self, ErrorKind, Read};

use crc32fast::Hasher;

use super::fault::Fault;
use super::file_source::FileSource;

/// Most bytes to request from the file at a time. Memory grows only with bytes that the file has.
const READ_SIZE_BYTES_MAX: u64 = 1 << 20;
/// Bytes that a skip reads at a time.
const SKIP_SIZE_BYTES: usize = 1 << 16;

/// The bytes of a file, in order.
pub(in crate::log) struct Source<R> {
    inner: R,
    position: u64,
    /// The checksum of the current section. `None` if nothing checks it.
    hasher: Option<Hasher>,
}

impl Source<FileSource> {
    /// Continues at a byte of the file. The rest of the file has no checksum.
    pub(in crate::log) fn go_to(&mut self, byte: u64) {
        self.inner.go_to(byte);
        self.position = byte;
        self.hasher = None;
    }
}

impl<R: Read> Source<R> {
    pub(in crate::log) fn with_checksum(inner: R) -> Self {
        Self { inner, position: 0, hasher: Some(Hasher::new()) }
    }

    pub(in crate::log) fn without_checksum(inner: R) -> Self {
        Self { inner, position: 0, hasher: None }
    }

    /// Returns the number of bytes read so far.
    pub(in crate::log) fn position(&self) -> u64 {
        self.position
    }

    /// Returns the checksum of the section so far.
    pub(in crate::log) fn checksum(&self) -> Option<u32> {
        self.hasher.clone().map(Hasher::finalize)
    }

    /// Starts another section.
    pub(in crate::log) fn restart_checksum(&mut self) {
        self.hasher = self.hasher.take().map(|_| Hasher::new());
    }

    /// Reads up to the length of the buffer. Returns 0 at the end of the file.
    pub(in crate::log) fn read_some(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = read_some(&mut self.inner, buffer)?;
        self.position += count as u64;
        if let Some(hasher) = &mut self.hasher {
            hasher.update(&buffer[..count]);
        }
        Ok(count)
    }

    /// Fills the buffer. Returns fewer bytes than its length at the end of the file.
    pub(in crate::log) fn fill(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut count = 0;
        while count < buffer.len() {
            match self.read_some(&mut buffer[count..])? {
                0 => break,
                more => count += more,
            }
        }
        Ok(count)
    }

    /// Replaces `out` with the next `size_bytes` bytes.
    pub(in crate::log) fn read_exactly(
        &mut self,
        size_bytes: u64,
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        out.clear();
        while (out.len() as u64) < size_bytes {
            let begin = out.len();
            let wanted = (size_bytes - begin as u64).min(READ_SIZE_BYTES_MAX);
            out.resize(begin + usize::try_from(wanted).unwrap_or(SKIP_SIZE_BYTES), 0);
            if self.fill(&mut out[begin..])? < out.len() - begin {
                return Err(Fault::Truncated);
            }
        }
        Ok(())
    }

    /// Skips `size_bytes` bytes.
    pub(in crate::log) fn skip(&mut self, size_bytes: u64) -> Result<(), Fault> {
        let mut left = size_bytes;
        let mut buffer = vec![0; usize::try_from(left).unwrap_or(usize::MAX).min(SKIP_SIZE_BYTES)];
        while left > 0 {
            let wanted = usize::try_from(left).unwrap_or(usize::MAX).min(buffer.len());
            match self.read_some(&mut buffer[..wanted])? {
                0 => return Err(Fault::Truncated),
                count => left -= count as u64,
            }
        }
        Ok(())
    }
}

fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
