//! The records of one chunk.

use std::io::Read;
use std::ops::Range;

use mcap::McapError;

use super::fault::Fault;
use super::limits::{RECORD_HEADER_SIZE_BYTES, SizeLimits, compression_growth};
use super::source::Source;

/// The fields before the name of the compression: two times, the uncompressed size, the checksum and
/// the length of the name.
const FIXED_SIZE_BYTES: usize = 8 + 8 + 8 + 4 + 4;
/// Longest name of a compression. Ours are "", "lz4" and "zstd".
const COMPRESSION_SIZE_BYTES_MAX: usize = 32;

/// The content of one chunk at a time. Its memory is reused.
#[derive(Default)]
pub(in crate::log) struct ChunkData {
    compressed: Vec<u8>,
    content: Vec<u8>,
    /// Place of the next record in the content.
    place: usize,
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

/// The start of a chunk whose sizes are within the limits.
pub(in crate::log) struct ChunkStartFields {
    compression: Vec<u8>,
    checksum: u32,
    sizes: Sizes,
}

impl ChunkStartFields {
    /// Reads the fields of a chunk record of `length` bytes, and compares its sizes with the limits.
    pub(in crate::log) fn read<R: Read>(
        source: &mut Source<R>,
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
        name_and_size.truncate(name_size);
        sizes.check(&name_and_size, limits)?;
        Ok(Self { compression: name_and_size, checksum: u32_at(&fixed, 24), sizes })
    }
}

impl ChunkData {
    /// Replaces the content with that of the chunk that `source` continues with, and verifies its checksum.
    pub(in crate::log) fn read<R: Read>(
        &mut self,
        source: &mut Source<R>,
        start: &ChunkStartFields,
    ) -> Result<(), Fault> {
        self.clear();
        let read = self.read_content(source, start);
        if read.is_err() {
            self.clear();
        }
        read
    }

    fn read_content<R: Read>(
        &mut self,
        source: &mut Source<R>,
        start: &ChunkStartFields,
    ) -> Result<(), Fault> {
        let Sizes { compressed, uncompressed, .. } = start.sizes;
        if start.compression.is_empty() {
            source.read_exactly(compressed, &mut self.content)?;
        } else {
            source.read_exactly(compressed, &mut self.compressed)?;
            self.decompress(&start.compression, uncompressed)?;
        }
        if self.content.len() as u64 != uncompressed {
            return Err(damaged("a chunk whose data has another length than its content"));
        }
        let saved = start.checksum;
        if saved != 0 {
            let calculated = crc32fast::hash(&self.content);
            if calculated != saved {
                return Err(McapError::BadChunkCrc { saved, calculated }.into());
            }
        }
        Ok(())
    }

    fn decompress(&mut self, compression: &[u8], size_bytes: u64) -> Result<(), Fault> {
        let failed = |error: std::io::Error| Fault::Damaged(error.to_string());
        match compression {
            b"zstd" => {
                let zstd = match &mut self.zstd {
                    Some(zstd) => zstd,
                    none => none.insert(zstd::bulk::Decompressor::new().map_err(failed)?),
                };
                // Within the limits of the scene.
                self.content.clear();
                self.content.reserve_exact(usize::try_from(size_bytes).unwrap_or(usize::MAX));
                zstd.decompress_to_buffer(&self.compressed, &mut self.content).map_err(failed)?;
                Ok(())
            }
            b"lz4" => {
                let decoder = lz4::Decoder::new(self.compressed.as_slice()).map_err(failed)?;
                decoder.take(size_bytes + 1).read_to_end(&mut self.content).map_err(failed)?;
                Ok(())
            }
            other => {
                let name = String::from_utf8_lossy(other).into_owned();
                Err(McapError::UnsupportedCompression(name).into())
            }
        }
    }

    /// Drops the content.
    pub(in crate::log) fn clear(&mut self) {
        self.content.clear();
        self.place = 0;
    }

    /// Returns the opcode of the next record and the place of its body, or `None` at the end of the chunk.
    pub(in crate::log) fn next_record(&mut self) -> Result<Option<(u8, Range<usize>)>, Fault> {
        let rest = &self.content[self.place..];
        if rest.is_empty() {
            return Ok(None);
        }
        let too_long = || damaged("a record that is longer than its chunk");
        let header = rest.first_chunk::<RECORD_HEADER_SIZE_BYTES>().ok_or_else(too_long)?;
        let [opcode, length @ ..] = *header;
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let begin = self.place + RECORD_HEADER_SIZE_BYTES;
        let end = begin.checked_add(length).filter(|end| *end <= self.content.len());
        self.place = end.ok_or_else(too_long)?;
        Ok(Some((opcode, begin..self.place)))
    }

    /// Returns the content of the chunk.
    pub(in crate::log) fn content(&self) -> &[u8] {
        &self.content
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
