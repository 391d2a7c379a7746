//! The records of one chunk.

use std::io::Read;

use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::fault::Fault;
use super::limits::{RECORD_HEADER_SIZE_BYTES, SizeLimits, compression_growth};
use super::source::Source;

/// The fields before the name of the compression: two times, the uncompressed size, the checksum and
/// the length of the name.
const FIXED_SIZE_BYTES: usize = 8 + 8 + 8 + 4 + 4;
/// Longest name of a compression. Ours are "", "lz4" and "zstd".
const COMPRESSION_SIZE_BYTES_MAX: usize = 32;
/// Most bytes to request from the file at a time.
const READ_SIZE_BYTES_MAX: u64 = 1 << 20;

/// A chunk whose sizes are within the limits. Decompresses it while it is read.
pub(in crate::log) struct ChunkData {
    linear: LinearReader,
    /// The start of the record, until the linear reader requests it.
    head: Vec<u8>,
    /// Bytes of the record after its start that the linear reader has not requested yet.
    remaining: u64,
}

impl ChunkData {
    /// Reads the header of a chunk and compares its sizes with the limits. `record_header` is the
    /// opcode and `length`, which precede it.
    pub(in crate::log) fn open<R: Read>(
        source: &mut Source<R>,
        record_header: [u8; RECORD_HEADER_SIZE_BYTES],
        length: u64,
        limits: &SizeLimits,
    ) -> Result<Self, Fault> {
        let mut fixed = [0; FIXED_SIZE_BYTES];
        fill(source, &mut fixed)?;
        let name_size = u32_at(&fixed, 28) as usize;
        if name_size > COMPRESSION_SIZE_BYTES_MAX {
            return Err(damaged(&format!("a chunk with a compression name of {name_size} bytes")));
        }
        let mut name_and_size = vec![0; name_size + size_of::<u64>()];
        fill(source, &mut name_and_size)?;
        let sizes = Sizes {
            header: (fixed.len() + name_and_size.len()) as u64,
            record: length,
            uncompressed: u64_at(&fixed, 16),
            compressed: u64_at(&name_and_size, name_size),
        };
        sizes.check(&name_and_size[..name_size], limits)?;
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(
                usize::try_from(sizes.uncompressed.max(sizes.compressed)).unwrap_or(usize::MAX),
            );
        Ok(Self {
            linear: LinearReader::new_with_options(options),
            head: [&record_header[..], &fixed, &name_and_size].concat(),
            remaining: sizes.compressed,
        })
    }

    /// Reads the next record into `body` and returns its opcode, or `None` at the end of the chunk.
    pub(in crate::log) fn next_record<R: Read>(
        &mut self,
        source: &mut Source<R>,
        body: &mut Vec<u8>,
    ) -> Result<Option<u8>, Fault> {
        loop {
            match self.linear.next_event() {
                Some(Ok(LinearReadEvent::ReadRequest(count))) => self.load(source, count)?,
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    body.clear();
                    body.extend_from_slice(data);
                    return Ok(Some(opcode));
                }
                Some(Err(error)) => return Err(self.fault(error)),
                None => return Ok(None),
            }
        }
    }

    /// Loads up to `count` bytes of the chunk, and none at its end.
    fn load<R: Read>(&mut self, source: &mut Source<R>, count: usize) -> Result<(), Fault> {
        if !self.head.is_empty() {
            self.linear.insert(self.head.len()).copy_from_slice(&self.head);
            self.linear.notify_read(self.head.len());
            self.head.clear();
            return Ok(());
        }
        let count = (count as u64).min(READ_SIZE_BYTES_MAX).min(self.remaining);
        if count == 0 {
            self.linear.notify_read(0);
            return Ok(());
        }
        let buffer = self.linear.insert(usize::try_from(count).unwrap_or(0));
        let read_count = source.read_some(buffer)?;
        if read_count == 0 {
            return Err(Fault::Truncated);
        }
        self.linear.notify_read(read_count);
        self.remaining -= read_count as u64;
        Ok(())
    }

    /// Returns the fault for an error of the linear reader. At the end of the chunk, the end of the
    /// data is not the end of the file.
    fn fault(&self, error: McapError) -> Fault {
        match error {
            McapError::UnexpectedEof if self.head.is_empty() && self.remaining == 0 => {
                damaged("a record that is longer than its chunk")
            }
            other => other.into(),
        }
    }
}

/// The sizes that a chunk claims, in bytes.
struct Sizes {
    header: u64,
    record: u64,
    uncompressed: u64,
    compressed: u64,
}

impl Sizes {
    fn check(&self, compression: &[u8], limits: &SizeLimits) -> Result<(), Fault> {
        let limit = limits.chunk_size_bytes_max();
        if self.uncompressed > limit {
            return Err(Fault::too_large("a chunk", self.uncompressed, limit));
        }
        // A record beside the compressed data would be loaded without a limit.
        if self.header.checked_add(self.compressed) != Some(self.record) {
            return Err(damaged("a chunk whose length differs from that of its data"));
        }
        let growth = match compression {
            b"" => 0,
            _ => compression_growth(self.uncompressed),
        };
        if self.compressed > self.uncompressed + growth {
            return Err(damaged("a chunk whose data is longer than its content"));
        }
        if compression.is_empty() && self.compressed < self.uncompressed {
            return Err(damaged("a chunk whose data is shorter than its content"));
        }
        Ok(())
    }
}

fn fill<R: Read>(source: &mut Source<R>, bytes: &mut [u8]) -> Result<(), Fault> {
    if source.fill(bytes)? < bytes.len() { Err(Fault::Truncated) } else { Ok(()) }
}

fn damaged(cause: &str) -> Fault {
    Fault::Damaged(cause.to_owned())
}

fn u32_at(bytes: &[u8], place: usize) -> u32 {
    bytes[place..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

fn u64_at(bytes: &[u8], place: usize) -> u64 {
    bytes[place..].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes))
}
