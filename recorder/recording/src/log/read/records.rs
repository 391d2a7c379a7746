//! The records of an MCAP file and of its chunks, one by one up to the first damage, with every checksum verified.

use std::io::Read;
use std::ops::Range;

use mcap::McapError;
use mcap::records::{Record, op};

use crate::log::read_error::{LogEnd, ReadError};
use crate::log::scanner::chunk::{ChunkContent, InnerRecord, InnerRecords};
use crate::log::scanner::limits::{RECORD_HEADER_SIZE_BYTES, SizeLimits, TEXT_SIZE_BYTES_MAX};
use crate::log::scanner::window::Window;
use crate::log::scanner::{FilePart, RecordScanner, SectionChecksum};

/// Reads the records one by one and remembers how far the file is intact.
pub(in crate::log) struct RecordReader<R> {
    scanner: RecordScanner<R>,
    pub(super) content: ChunkContent,
    chunk: Option<ChunkPlace>,
    /// End of the last intact record, or of the chunk that contains it.
    intact_count: u64,
    /// The end of the file, once it is reached.
    pub(in crate::log) end: Option<LogEnd>,
}

/// The chunk that is being read.
struct ChunkPlace {
    /// The data in the file.
    data: Range<u64>,
    /// Position of the next record in the content.
    offset: usize,
}

impl<R: Read> RecordReader<R> {
    pub(in crate::log) fn new(window: Window<R>) -> Result<Self, ReadError> {
        Ok(Self {
            scanner: RecordScanner::new(window)?.stopping_at_damage(),
            content: ChunkContent::default(),
            chunk: None,
            intact_count: 0,
            end: None,
        })
    }

    /// Continues with the record that begins at a byte of the file.
    pub(in crate::log) fn go_to(&mut self, byte: u64) {
        self.scanner.go_to(byte);
        (self.chunk, self.end, self.intact_count) = (None, None, byte);
    }

    /// Returns the position up to which the file is intact.
    pub(in crate::log) fn intact_count(&self) -> u64 {
        self.intact_count
    }

    /// Sets the limits, once the size of the scene is known. Until then no chunk is read.
    pub(in crate::log) fn set_limits(&mut self, limits: SizeLimits) {
        self.scanner.set_limits(limits);
    }

    /// Passes the next record to `read`, with the position up to which the file is intact.
    /// Returns `None` at the end of the readable part.
    pub(in crate::log) fn next<T>(
        &mut self,
        read: impl FnOnce(Record<'_>, u64) -> Result<T, ReadError>,
    ) -> Result<Option<T>, ReadError> {
        while self.end.is_none() {
            self.intact_count = self.scanner.position();
            let byte = self.intact_count;
            if let Some(chunk) = &mut self.chunk {
                let data = self.scanner.bytes(&chunk.data)?;
                let mut records = InnerRecords::from(self.content.of(data), chunk.offset);
                let record = records.next().map(|record| record.and_then(|one| parse_inner(&one)));
                chunk.offset = records.offset;
                match record {
                    None => self.chunk = None,
                    Some(Ok(record)) => return read(record, byte).map(Some),
                    Some(Err(cause)) => self.end = Some(LogEnd::Damaged { byte, cause }),
                }
                continue;
            }
            let end = match self.scanner.next()? {
                None => Ok(LogEnd::Complete),
                Some(FilePart::Record { opcode, body, section, .. }) => {
                    match parse(opcode, body, section) {
                        Ok(None) => continue,
                        Ok(Some(record)) => {
                            let byte = byte + (RECORD_HEADER_SIZE_BYTES + body.len()) as u64;
                            self.intact_count = byte;
                            return read(record, byte).map(Some);
                        }
                        Err(cause) => Err(cause),
                    }
                }
                Some(FilePart::Chunk { size_bytes, chunk, .. }) => {
                    let end = byte + size_bytes as u64;
                    let data = end - chunk.data.len() as u64..end;
                    self.chunk = Some(ChunkPlace { data, offset: 0 });
                    match self.content.read(&chunk) {
                        Ok(()) => continue,
                        Err(cause) => Err(cause),
                    }
                }
                // One before the metadata of the run is not one of ours.
                Some(FilePart::Skipped { opcode: opcode @ op::CHUNK, .. }) => {
                    return read(Record::Unknown { opcode, data: (&[]).into() }, byte).map(Some);
                }
                Some(FilePart::LongAttachment { .. } | FilePart::Skipped { .. }) => continue,
                Some(FilePart::Truncated { byte }) => Ok(LogEnd::Truncated { byte }),
                Some(FilePart::Damaged { cause, .. }) => Err(cause),
                Some(FilePart::AfterEnd { bytes }) => {
                    self.intact_count = bytes.start;
                    Err("other bytes follow the end of the recording, such as a second file"
                        .to_owned())
                }
            };
            let byte = self.intact_count;
            self.end = Some(end.unwrap_or_else(|cause| LogEnd::Damaged { byte, cause }));
        }
        Ok(None)
    }
}

/// Parses a record outside of chunks that a reader of messages uses. `Err` describes damage.
fn parse(
    opcode: u8,
    body: &[u8],
    section: Option<SectionChecksum>,
) -> Result<Option<Record<'_>>, String> {
    if let Some(SectionChecksum { saved, calculated }) =
        section.filter(|section| section.is_wrong())
    {
        let error = match opcode {
            op::FOOTER => McapError::BadSummaryCrc { saved, calculated },
            _ => McapError::BadDataCrc { saved, calculated },
        };
        return Err(error.to_string());
    }
    if !is_used(opcode) {
        return Ok(None);
    }
    mcap::parse_record(opcode, body).map(Some).map_err(|error| error.to_string())
}

/// Parses a record of a chunk. A record that no reader of messages uses, or that is longer than any record of the
/// recorder, is returned without its content.
pub(in crate::log) fn parse_inner<'a>(record: &InnerRecord<'a>) -> Result<Record<'a>, String> {
    let InnerRecord { opcode, body, .. } = *record;
    let is_text = is_used(opcode) && opcode != op::MESSAGE;
    if !is_used(opcode) || is_text && body.len() as u64 > TEXT_SIZE_BYTES_MAX {
        return Ok(Record::Unknown { opcode, data: (&[]).into() });
    }
    record.parse()
}

/// Returns `true` for the records that a reader of messages uses.
fn is_used(opcode: u8) -> bool {
    matches!(
        opcode,
        op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA
    )
}
