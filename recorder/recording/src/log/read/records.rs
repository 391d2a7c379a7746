//! The records of an MCAP file, one by one, with every checksum verified.
//!
//! This reader owns the framing of the file, so that it can compare each length with the limits of
//! the scene before anything is allocated, and decompresses each chunk at once. The mcap crate parses records.

use std::io::Read;
use std::ops::Range;

use mcap::McapError;
use mcap::records::{Record, op};

use super::chunk_data::{ChunkData, ChunkStartFields};
use super::fault::Fault;
use super::file_source::FileSource;
use super::lengths::check_lengths;
use super::limits::{
    HEADER_RECORD_SIZE_BYTES_MAX, RECORD_HEADER_SIZE_BYTES, SizeLimits, TEXT_SIZE_BYTES_MAX,
};
use super::read_error::{LogEnd, ReadError};
use super::source::Source;

/// Bytes of a footer that its checksum includes, and the checksum.
const FOOTER_SIZE_BYTES: (usize, usize) = (16, 4);

/// Reads the records one by one and remembers how far the file is intact.
pub(in crate::log) struct RecordReader<R> {
    source: Source<R>,
    /// `None` until the size of the scene is known.
    limits: Option<SizeLimits>,
    /// The source is a part of a file, without magic.
    is_part: bool,
    /// The record outside a chunk that was read last.
    body: Vec<u8>,
    /// The chunk that is being read.
    chunk: ChunkData,
    /// End of the last intact record, or of the chunk that contains it.
    intact_count: u64,
    /// The file starts as an MCAP file does.
    pub(in crate::log) is_mcap: bool,
    /// The end of the file, once it is reached.
    pub(in crate::log) end: Option<LogEnd>,
}

/// The part of a file that was read last.
enum Part {
    /// A record, in [`RecordReader::body`].
    Record(u8),
    /// A record of the chunk, at a place of its content.
    Inner(u8, Range<usize>),
    /// A record that is longer than any of a recorder. It is not read.
    TooLong(u8),
    /// A record that no reader of ours needs, or a chunk, whose records come next.
    Other,
    End,
}

impl RecordReader<FileSource> {
    /// Continues with the record that begins at a byte of the file.
    pub(in crate::log) fn go_to(&mut self, byte: u64) {
        self.source.go_to(byte);
        self.chunk.clear();
        self.intact_count = byte;
        self.end = None;
    }
}

impl<R: Read> RecordReader<R> {
    pub(in crate::log) fn new(source: R) -> Self {
        Self::with_source(Source::with_checksum(source), None)
    }

    /// Reads records from the middle of a file.
    pub(in crate::log) fn without_magic(source: R, limits: SizeLimits) -> Self {
        let reader = Self::with_source(Source::without_checksum(source), Some(limits));
        Self { is_part: true, is_mcap: true, ..reader }
    }

    fn with_source(source: Source<R>, limits: Option<SizeLimits>) -> Self {
        Self {
            source,
            limits,
            is_part: false,
            body: Vec::new(),
            chunk: ChunkData::default(),
            intact_count: 0,
            is_mcap: false,
            end: None,
        }
    }

    /// Returns the position up to which the file is intact.
    pub(in crate::log) fn intact_count(&self) -> u64 {
        self.intact_count
    }

    /// Returns `true` if the file had no bytes when its end was reached.
    pub(in crate::log) fn is_empty(&self) -> bool {
        self.source.position() == 0
    }

    /// Sets the limits, once the size of the scene is known. Until then no chunk is read.
    pub(in crate::log) fn set_limits(&mut self, limits: SizeLimits) {
        self.limits = Some(limits);
    }

    /// Passes the next record to `read`, with the position up to which the file is intact.
    /// Returns `None` at the end of the readable part.
    pub(in crate::log) fn next<T>(
        &mut self,
        read: impl FnOnce(Record<'_>, u64) -> Result<T, ReadError>,
    ) -> Result<Option<T>, ReadError> {
        while self.end.is_none() {
            let (opcode, body) = match self.next_part() {
                Ok(Part::Record(opcode)) => (opcode, self.body.as_slice()),
                Ok(Part::Inner(opcode, place)) => (opcode, &self.chunk.content()[place]),
                Ok(Part::TooLong(opcode)) => {
                    self.intact_count = self.source.position();
                    let record = Record::Unknown { opcode, data: (&[]).into() };
                    return read(record, self.intact_count).map(Some);
                }
                Ok(Part::Other) => continue,
                Ok(Part::End) => {
                    self.end = Some(LogEnd::Complete);
                    continue;
                }
                Err(fault) => {
                    self.stop(fault)?;
                    continue;
                }
            };
            self.intact_count = self.source.position();
            match parse(opcode, body) {
                Ok(record) => return read(record, self.intact_count).map(Some),
                Err(fault) => self.stop(fault)?,
            }
        }
        Ok(None)
    }

    /// Reads the next record of the chunk that is being read, or else of the file.
    fn next_part(&mut self) -> Result<Part, Fault> {
        let Some((opcode, place)) = self.chunk.next_record()? else { return self.read_part() };
        let is_text = matches!(opcode, op::HEADER | op::SCHEMA | op::CHANNEL | op::METADATA);
        let is_too_long = is_text && place.len() as u64 > TEXT_SIZE_BYTES_MAX;
        Ok(if is_too_long { Part::TooLong(opcode) } else { Part::Inner(opcode, place) })
    }

    fn stop(&mut self, fault: Fault) -> Result<(), ReadError> {
        let byte = self.intact_count;
        self.end = Some(match fault {
            Fault::Io(error) => return Err(error.into()),
            Fault::Truncated => LogEnd::Truncated { byte },
            Fault::Damaged(cause) => LogEnd::Damaged { byte, cause },
        });
        Ok(())
    }

    fn read_part(&mut self) -> Result<Part, Fault> {
        if !self.is_mcap {
            self.read_magic()?;
            self.is_mcap = true;
        }
        let checksum_before = self.source.checksum();
        let mut header = [0; RECORD_HEADER_SIZE_BYTES];
        match self.source.fill(&mut header)? {
            RECORD_HEADER_SIZE_BYTES => {}
            0 if self.is_part => return Ok(Part::End),
            _ => return Err(Fault::Truncated),
        }
        let [opcode, length @ ..] = header;
        let length = u64::from_le_bytes(length);
        match opcode {
            op::CHUNK => self.read_chunk(length),
            op::DATA_END => self.read_data_end(length, checksum_before),
            op::FOOTER => self.read_footer(length),
            op::HEADER | op::SCHEMA | op::CHANNEL | op::METADATA => {
                self.read_record(opcode, length, TEXT_SIZE_BYTES_MAX)
            }
            op::ATTACHMENT => self.read_record(opcode, length, HEADER_RECORD_SIZE_BYTES_MAX),
            op::MESSAGE => {
                let limits = self.limits.as_ref();
                let limit = limits.map_or(TEXT_SIZE_BYTES_MAX, SizeLimits::record_size_bytes_max);
                if length > limit {
                    return Err(Fault::too_large("a message", length, limit));
                }
                self.read_record(opcode, length, limit)
            }
            0 => Err(Fault::Damaged("a record with opcode 0".to_owned())),
            _ => self.skip_record(length),
        }
    }

    fn read_magic(&mut self) -> Result<(), Fault> {
        let mut magic = [0; mcap::MAGIC.len()];
        if self.source.fill(&mut magic)? < magic.len() {
            return Err(Fault::Truncated);
        }
        if magic == *mcap::MAGIC { Ok(()) } else { Err(McapError::BadMagic.into()) }
    }

    /// Reads a record into [`Self::body`]. Other tools may have added longer records than ours after
    /// the header of a recording. They are skipped.
    fn read_record(&mut self, opcode: u8, length: u64, limit: u64) -> Result<Part, Fault> {
        if length <= limit {
            self.source.read_exactly(length, &mut self.body)?;
            return Ok(Part::Record(opcode));
        }
        match self.limits {
            Some(_) => self.skip_record(length).map(|_| Part::TooLong(opcode)),
            None => Err(Fault::too_large("a record before the first message", length, limit)),
        }
    }

    fn skip_record(&mut self, length: u64) -> Result<Part, Fault> {
        self.source.skip(length)?;
        self.intact_count = self.source.position();
        Ok(Part::Other)
    }

    /// Reads a chunk. One before the metadata of the run is not one of ours. It is reported, but not read.
    fn read_chunk(&mut self, length: u64) -> Result<Part, Fault> {
        let Some(limits) = &self.limits else {
            self.body.clear();
            return Ok(Part::Record(op::CHUNK));
        };
        let start = ChunkStartFields::read(&mut self.source, length, limits)?;
        self.chunk.read(&mut self.source, &start)?;
        Ok(Part::Other)
    }

    fn read_data_end(&mut self, length: u64, calculated: Option<u32>) -> Result<Part, Fault> {
        self.read_short(length)?;
        let saved = self.body.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
        let saved =
            saved.ok_or_else(|| Fault::Damaged("the end of the data is too short".into()))?;
        if let Some(calculated) = calculated.filter(|calculated| saved != 0 && *calculated != saved)
        {
            return Err(McapError::BadDataCrc { saved, calculated }.into());
        }
        self.source.restart_checksum();
        self.intact_count = self.source.position();
        Ok(Part::Other)
    }

    fn read_footer(&mut self, length: u64) -> Result<Part, Fault> {
        let (checked_size, crc_size) = FOOTER_SIZE_BYTES;
        let mut checked = vec![0; checked_size];
        if self.source.fill(&mut checked)? < checked_size {
            return Err(Fault::Truncated);
        }
        let calculated = self.source.checksum();
        let mut saved = [0; size_of::<u32>()];
        if self.source.fill(&mut saved)? < crc_size {
            return Err(Fault::Truncated);
        }
        if length != (checked_size + crc_size) as u64 {
            return Err(Fault::Damaged("the footer has another length".to_owned()));
        }
        let saved = u32::from_le_bytes(saved);
        if let Some(calculated) = calculated.filter(|calculated| saved != 0 && *calculated != saved)
        {
            return Err(McapError::BadSummaryCrc { saved, calculated }.into());
        }
        self.read_magic()?;
        self.intact_count = self.source.position();
        if self.source.fill(&mut [0])? > 0 {
            let cause = "other bytes follow the end of the recording, such as a second file";
            return Err(Fault::Damaged(cause.to_owned()));
        }
        Ok(Part::End)
    }

    fn read_short(&mut self, length: u64) -> Result<(), Fault> {
        if length > TEXT_SIZE_BYTES_MAX {
            return Err(Fault::too_large("the end of the data", length, TEXT_SIZE_BYTES_MAX));
        }
        self.source.read_exactly(length, &mut self.body)
    }
}

/// Parses the records that this reader uses.
fn parse(opcode: u8, data: &[u8]) -> Result<Record<'_>, Fault> {
    match opcode {
        op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA => {
            check_lengths(opcode, data).map_err(Fault::Damaged)?;
            Ok(mcap::parse_record(opcode, data)?)
        }
        _ => Ok(Record::Unknown { opcode, data: data.into() }),
    }
}
