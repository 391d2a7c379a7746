//! Chunks: the sizes that they claim, their content, and the records in it.

use mcap::McapError;
use mcap::records::{ChunkHeader, Record};

use crate::log::compression::{Decompress, decompressor};

use super::fields::{Unread, check_fields};
use super::limits::{RECORD_HEADER_SIZE_BYTES, SizeLimits, compression_growth};

/// The longest fields before the data of a chunk: three numbers of 64 bits, a checksum, the name of the compression with
/// its length, and the length of the data.
pub(super) const CHUNK_START_SIZE_BYTES_MAX: usize = 3 * 8 + 4 + 4 + 32 + 8;

/// A chunk whose sizes are within the limits. Its content is not verified.
#[derive(Debug)]
pub(in crate::log) struct Chunk<'a> {
    pub(in crate::log) header: ChunkHeader,
    /// The content, as it is compressed.
    pub(in crate::log) data: &'a [u8],
}

impl<'a> Chunk<'a> {
    /// Divides the body of a chunk record. `Err` describes a size that contradicts the others or the limits.
    pub(in crate::log) fn new(body: &'a [u8], limits: &SizeLimits) -> Result<Self, String> {
        let (header, start_size) = chunk_header(body, body.len() as u64, limits)?;
        Ok(Self { header, data: &body[start_size..] })
    }
}

/// Reads the fields of a chunk record of `length` bytes before its data, from its first bytes, and compares its sizes
/// with each other and with the limits. Returns them with the number of their bytes.
pub(super) fn chunk_header(
    start: &[u8],
    length: u64,
    limits: &SizeLimits,
) -> Result<(ChunkHeader, usize), String> {
    let other_length = "a chunk whose length differs from that of its data";
    let mut rest = Unread(start);
    let header = read_header(&mut rest).ok_or(other_length)?;
    let start_size = start.len() - rest.0.len();
    let (uncompressed, compressed) = (header.uncompressed_size, header.compressed_size);
    let limit = limits.chunk_size_bytes_max();
    let is_compressed = !header.compression.is_empty();
    let growth = if is_compressed { compression_growth(uncompressed) } else { 0 };
    if uncompressed > limit {
        Err(SizeLimits::exceeded("a chunk", uncompressed, limit))
    } else if (start_size as u64).checked_add(compressed) != Some(length) {
        Err(other_length.to_owned())
    } else if compressed > uncompressed + growth {
        Err("a chunk whose data is longer than its content".to_owned())
    } else if !is_compressed && compressed < uncompressed {
        Err("a chunk whose data is shorter than its content".to_owned())
    } else {
        Ok((header, start_size))
    }
}

fn read_header(rest: &mut Unread<'_>) -> Option<ChunkHeader> {
    Some(ChunkHeader {
        message_start_time: rest.u64()?,
        message_end_time: rest.u64()?,
        uncompressed_size: rest.u64()?,
        uncompressed_crc: rest.u32()?,
        compression: rest.text()?,
        compressed_size: rest.u64()?,
    })
}

/// The content of chunks, one at a time. Its memory is reused.
pub(in crate::log) struct ChunkContent {
    /// The chunk is compressed, so its content is not its data.
    is_compressed: bool,
    decompressed: Vec<u8>,
    pub(in crate::log) decompress: Decompress,
}

impl Default for ChunkContent {
    fn default() -> Self {
        Self { is_compressed: false, decompressed: Vec::new(), decompress: decompressor() }
    }
}

impl ChunkContent {
    /// Decompresses a chunk and compares its checksum. `Err` describes the damage.
    pub(in crate::log) fn read(&mut self, chunk: &Chunk<'_>) -> Result<(), String> {
        let size_bytes = chunk.header.uncompressed_size;
        self.is_compressed = !chunk.header.compression.is_empty();
        self.decompressed.clear();
        match chunk.header.compression.as_str() {
            "" => {}
            "zstd" | "lz4" => {
                (self.decompress)(&chunk.header, chunk.data, &mut self.decompressed)
                    .map_err(|error| error.to_string())?;
            }
            other => return Err(McapError::UnsupportedCompression(other.to_owned()).to_string()),
        }
        let (content, saved) = (self.of(chunk.data), chunk.header.uncompressed_crc);
        if content.len() as u64 != size_bytes {
            return Err("a chunk whose data has another length than its content".to_owned());
        }
        if saved != 0 {
            let calculated = crc32fast::hash(content);
            if calculated != saved {
                return Err(McapError::BadChunkCrc { saved, calculated }.to_string());
            }
        }
        Ok(())
    }

    /// Returns the content of the chunk that was read last, from its data.
    pub(in crate::log) fn of<'a>(&'a self, data: &'a [u8]) -> &'a [u8] {
        if self.is_compressed { &self.decompressed } else { data }
    }
}

/// The records of a content, one by one.
#[derive(Debug)]
pub(in crate::log) struct InnerRecords<'a> {
    content: &'a [u8],
    /// Position of the next record in the content.
    pub(in crate::log) offset: usize,
}

/// A record within a chunk.
#[derive(Debug, Clone, Copy)]
pub(in crate::log) struct InnerRecord<'a> {
    /// Position in the content.
    pub(in crate::log) offset: u64,
    pub(in crate::log) opcode: u8,
    pub(in crate::log) body: &'a [u8],
}

impl<'a> InnerRecord<'a> {
    pub(in crate::log) fn parse(&self) -> Result<Record<'a>, String> {
        check_fields(self.opcode, self.body)?;
        mcap::parse_record(self.opcode, self.body).map_err(|error| error.to_string())
    }
}

impl<'a> InnerRecords<'a> {
    /// Continues at a position in the content.
    pub(in crate::log) fn from(content: &'a [u8], offset: usize) -> Self {
        Self { content, offset }
    }
}

impl<'a> Iterator for InnerRecords<'a> {
    /// `Err` describes a record that is longer than its chunk.
    type Item = Result<InnerRecord<'a>, String>;

    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.content.get(self.offset..).filter(|rest| !rest.is_empty())?;
        let offset = self.offset as u64;
        let too_long = || Some(Err("a record that is longer than its chunk".to_owned()));
        self.offset = self.content.len();
        let Some((header, body)) = rest.split_first_chunk::<RECORD_HEADER_SIZE_BYTES>() else {
            return too_long();
        };
        let [opcode, length @ ..] = *header;
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let Some(body) = body.get(..length) else { return too_long() };
        self.offset = self.content.len() - rest.len() + RECORD_HEADER_SIZE_BYTES + length;
        Some(Ok(InnerRecord { offset, opcode, body }))
    }
}
