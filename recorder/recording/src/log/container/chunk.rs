//! The content of a chunk, decompressed and with its checksum verified.

use mcap::records::{ChunkHeader, Record, op};

use crate::log::read::chunk_data::{ChunkData, ChunkStartFields};
use crate::log::read::fault::Fault;
use crate::log::read::lengths::is_exact;
use crate::log::read::limits::{RECORD_HEADER_SIZE_BYTES, SizeLimits};
use crate::log::read::read_error::ReadError;
use crate::log::read::source::Source;

/// Checks the sizes in the header of a chunk against each other and the limits.
pub(super) fn is_chunk(body: &[u8], limits: &SizeLimits) -> Result<(), String> {
    if !is_exact(op::CHUNK, body) {
        return Err("a chunk whose length differs from that of its data".to_owned());
    }
    let fields =
        ChunkStartFields::read(&mut Source::without_checksum(body), body.len() as u64, limits);
    fields.map(drop).map_err(fault_text)
}

/// Returns the compression that the header of a chunk names.
pub(super) fn compression(body: &[u8]) -> Option<String> {
    match mcap::parse_record(op::CHUNK, body) {
        Ok(Record::Chunk { header, .. }) => Some(header.compression),
        _ => None,
    }
}

/// The content of chunks, one at a time.
#[derive(Default)]
pub(super) struct ChunkContent(ChunkData);

/// A chunk with its content.
#[derive(Debug)]
pub(super) struct Chunk<'a> {
    pub(super) header: ChunkHeader,
    /// The records, one after the other.
    pub(super) content: &'a [u8],
    /// The chunk has a checksum, and it was compared.
    pub(super) has_checksum: bool,
}

impl ChunkContent {
    /// Returns the content of a chunk. The inner `Err` is the damage.
    pub(super) fn read<'a>(
        &'a mut self,
        body: &'a [u8],
        limits: &SizeLimits,
    ) -> Result<Result<Chunk<'a>, String>, ReadError> {
        let (header, data) = match mcap::parse_record(op::CHUNK, body) {
            Ok(Record::Chunk { header, .. }) => {
                let size_bytes = usize::try_from(header.compressed_size).unwrap_or(usize::MAX);
                (header, &body[body.len() - size_bytes.min(body.len())..])
            }
            Ok(_) => return Ok(Err("it is no chunk".to_owned())),
            Err(error) => return Ok(Err(error.to_string())),
        };
        let content = if header.compression.is_empty() {
            data
        } else {
            match self.decompress(body, limits) {
                Ok(()) => {}
                Err(Fault::Io(error)) => return Err(error.into()),
                Err(fault) => return Ok(Err(fault_text(fault))),
            }
            self.0.content()
        };
        let has_checksum = header.uncompressed_crc != 0;
        if has_checksum {
            let (saved, calculated) = (header.uncompressed_crc, crc32fast::hash(content));
            if saved != calculated {
                return Ok(Err(format!(
                    "its checksum is {saved:08x}, but its content has {calculated:08x}"
                )));
            }
        }
        if content.len() as u64 != header.uncompressed_size {
            let (found, claimed) = (content.len(), header.uncompressed_size);
            return Ok(Err(format!("it has {found} bytes of content instead of {claimed}")));
        }
        Ok(Ok(Chunk { header, content, has_checksum }))
    }

    fn decompress(&mut self, body: &[u8], limits: &SizeLimits) -> Result<(), Fault> {
        let mut source = Source::without_checksum(body);
        let fields = ChunkStartFields::read(&mut source, body.len() as u64, limits)?;
        self.0.read(&mut source, &fields)
    }
}

/// The records of a content, one by one.
#[derive(Debug)]
pub(super) struct InnerRecords<'a> {
    content: &'a [u8],
    offset: usize,
}

/// A record within a chunk.
#[derive(Debug, Clone, Copy)]
pub(super) struct InnerRecord<'a> {
    /// Position in the content.
    pub(super) offset: u64,
    pub(super) opcode: u8,
    pub(super) body: &'a [u8],
}

impl<'a> InnerRecords<'a> {
    pub(super) fn new(content: &'a [u8]) -> Self {
        Self { content, offset: 0 }
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

fn fault_text(fault: Fault) -> String {
    match fault {
        Fault::Io(error) => error.to_string(),
        Fault::Truncated => "its data ends too early".to_owned(),
        Fault::Damaged(cause) => cause,
    }
}
