//! The records of an MCAP file, one after the other: the only reader of the framing of a file.
//!
//! Every record has a form that its length must match exactly, so a wrong length is noticed at its own
//! record, before memory is allocated for it. Behind a damaged record, the scanner searches byte by byte for the next
//! record of a file, unless its reader stops there. It does not accept records that also occur within chunks, or it
//! would read the content of an uncompressed chunk as if no checksum belonged to it.

pub(super) mod chunk;
pub(super) mod fields;
pub(super) mod limits;
pub(super) mod window;

use std::io::Read;
use std::ops::Range;

use crc32fast::Hasher;
use mcap::MAGIC;
use mcap::records::{AttachmentHeader, ChunkHeader, op};

use super::read_error::ReadError;
use chunk::{CHUNK_START_SIZE_BYTES_MAX, Chunk, chunk_header};
use fields::{Unread, check_fields};
use limits::{
    HEADER_RECORD_SIZE_BYTES_MAX, RECORD_HEADER_SIZE_BYTES, SizeLimits, TEXT_SIZE_BYTES_MAX,
};
use window::Window;

/// Longest record of an index: one entry of 16 bytes for each message of a chunk. A message has at
/// least 31 bytes.
const INDEX_SIZE_BYTES_MAX: u64 = 8 << 20;
/// Bytes to examine or to add to a checksum at a time.
const BLOCK_SIZE_BYTES: usize = 1 << 20;
/// First opcode of private records.
const PRIVATE_MIN: u8 = 0x80;

/// A part of a file.
#[derive(Debug)]
pub(super) enum FilePart<'a> {
    /// A record whose form is intact. The end of the data and the footer end a section.
    Record { byte: u64, opcode: u8, body: &'a [u8], section: Option<SectionChecksum> },
    /// A chunk whose form is intact, and whose sizes are within the limits. `size_bytes` is the size of its record.
    Chunk { byte: u64, size_bytes: usize, chunk: Chunk<'a> },
    /// An attachment that is too long for memory.
    LongAttachment { attachment: LongAttachment, checksum: Checksum },
    /// A record that is not read: a private record, or a chunk before the description of the run.
    Skipped { byte: u64, opcode: u8 },
    /// Bytes that are no records. A scanner that stops there does not know their end.
    Damaged { bytes: Range<u64>, cause: String },
    /// The file ends within a record, or before its end.
    Truncated { byte: u64 },
    /// Other bytes follow the end of the recording, such as a second file.
    AfterEnd { bytes: Range<u64> },
}

/// The checksum of a section of the file: in the record that ends the section, and of the bytes that were read.
#[derive(Debug, Clone, Copy)]
pub(super) struct SectionChecksum {
    /// 0 if the file has none.
    pub(super) saved: u32,
    pub(super) calculated: u32,
}

impl SectionChecksum {
    pub(super) fn is_wrong(self) -> bool {
        self.saved != 0 && self.saved != self.calculated
    }
}

/// An attachment that is too long for memory.
#[derive(Debug, Clone)]
pub(super) struct LongAttachment {
    pub(super) byte: u64,
    /// Size of the whole record.
    pub(super) size_bytes: u64,
    pub(super) header: AttachmentHeader,
    /// The data in the file.
    pub(super) data: Range<u64>,
}

/// The result of the comparison with the checksum of an attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Checksum {
    Right,
    Wrong,
    Missing,
}

/// The form of the bytes at a position.
enum Form {
    Record { opcode: u8, size_bytes: usize },
    Chunk { header: ChunkHeader, start_size: usize, size_bytes: usize },
    LongAttachment(LongAttachment),
    Skipped { opcode: u8, size_bytes: u64 },
    EndOfFile,
    Wrong { cause: String, is_cut: bool },
}

/// Reads the records of a file.
pub(super) struct RecordScanner<R> {
    window: Window<R>,
    /// Position of the next record.
    at: u64,
    /// `None` until the size of the scene is known.
    limits: Option<SizeLimits>,
    /// The scanner goes on behind damage.
    goes_on: bool,
    /// The checksum of the current section up to `at`. `None` if its start was not read.
    section: Option<Hasher>,
    is_after_footer: bool,
    is_done: bool,
}

impl<R: Read> RecordScanner<R> {
    /// Begins after the magic of a file. The scanner goes on behind damage.
    pub(super) fn new(mut window: Window<R>) -> Result<Self, ReadError> {
        let magic = window.bytes(0, MAGIC.len())?;
        if magic.is_empty() {
            return Err(ReadError::Empty);
        }
        if magic != MAGIC {
            return Err(ReadError::NotMcap);
        }
        let mut section = Hasher::new();
        section.update(MAGIC);
        Ok(Self {
            window,
            at: MAGIC.len() as u64,
            limits: None,
            goes_on: true,
            section: Some(section),
            is_after_footer: false,
            is_done: false,
        })
    }

    /// Stops at the first damage.
    pub(super) fn stopping_at_damage(self) -> Self {
        Self { goes_on: false, ..self }
    }

    /// Continues with the record at a position. The rest of the file has no checksum.
    pub(super) fn go_to(&mut self, byte: u64) {
        self.at = byte;
        self.section = None;
        (self.is_after_footer, self.is_done) = (false, false);
    }

    /// Sets the limits, once the size of the scene is known.
    pub(super) fn set_limits(&mut self, limits: SizeLimits) {
        self.limits = Some(limits);
    }

    /// Returns the position of the next record.
    pub(super) fn position(&self) -> u64 {
        self.at
    }

    pub(super) fn size_bytes(&self) -> u64 {
        self.window.size_bytes()
    }

    /// Returns the next part, or `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<FilePart<'_>>, ReadError> {
        self.window.check_stop()?;
        if self.is_done {
            return Ok(None);
        }
        if self.is_after_footer {
            return self.end();
        }
        let byte = self.at;
        let part = match self.form(byte)? {
            Form::Record { opcode, size_bytes } => self.record(byte, opcode, size_bytes)?,
            Form::Chunk { header, start_size, size_bytes } => {
                self.advance(byte + size_bytes as u64)?;
                let data = &self.body(byte, size_bytes)?[start_size..];
                FilePart::Chunk { byte, size_bytes, chunk: Chunk { header, data } }
            }
            Form::LongAttachment(attachment) => self.long_attachment(attachment)?,
            Form::Skipped { opcode, size_bytes } => {
                let is_whole = self.advance(byte + size_bytes)?;
                if is_whole { FilePart::Skipped { byte, opcode } } else { self.truncated(byte) }
            }
            Form::EndOfFile => self.truncated(byte),
            Form::Wrong { cause, is_cut } => self.damage(byte, cause, is_cut)?,
        };
        Ok(Some(part))
    }

    fn truncated(&mut self, byte: u64) -> FilePart<'static> {
        self.is_done = true;
        FilePart::Truncated { byte }
    }

    /// Returns the body of a record in memory.
    fn body(&mut self, byte: u64, size_bytes: usize) -> Result<&[u8], ReadError> {
        Ok(&self.window.bytes(byte, size_bytes)?[RECORD_HEADER_SIZE_BYTES..])
    }

    fn record(
        &mut self,
        byte: u64,
        opcode: u8,
        size_bytes: usize,
    ) -> Result<FilePart<'_>, ReadError> {
        let end = byte + size_bytes as u64;
        let calculated = match opcode {
            op::DATA_END => {
                let data = self.section.take();
                self.section = data.as_ref().map(|_| Hasher::new());
                data
            }
            op::FOOTER => {
                self.is_after_footer = true;
                self.advance(end - size_of::<u32>() as u64)?;
                self.section.take()
            }
            _ => {
                self.advance(end)?;
                None
            }
        };
        self.at = end;
        let body = self.body(byte, size_bytes)?;
        let section = calculated.zip(body.last_chunk()).map(|(calculated, saved)| {
            SectionChecksum { saved: u32::from_le_bytes(*saved), calculated: calculated.finalize() }
        });
        Ok(FilePart::Record { byte, opcode, body, section })
    }

    /// Compares a long attachment with its checksum, in pieces.
    fn long_attachment(&mut self, attachment: LongAttachment) -> Result<FilePart<'_>, ReadError> {
        let mut hasher = Hasher::new();
        let LongAttachment { byte, size_bytes, data, .. } = &attachment;
        let (byte, mut at) = (*byte, byte + RECORD_HEADER_SIZE_BYTES as u64);
        self.advance(at)?;
        while at < data.end {
            let block = self.block(at..data.end)?;
            if block.is_empty() {
                return Ok(self.truncated(byte));
            }
            hasher.update(block);
            at += block.len() as u64;
            self.advance(at)?;
        }
        let saved = Unread(self.window.bytes(data.end, size_of::<u32>())?).u32();
        let Some(saved) = saved else { return Ok(self.truncated(byte)) };
        let checksum = match saved {
            0 => Checksum::Missing,
            saved if saved == hasher.finalize() => Checksum::Right,
            _ => Checksum::Wrong,
        };
        self.advance(byte + size_bytes)?;
        Ok(FilePart::LongAttachment { attachment, checksum })
    }

    /// Returns a range of the part that was read last.
    pub(super) fn bytes(&mut self, range: &Range<u64>) -> Result<&[u8], ReadError> {
        let size_bytes = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
        self.window.bytes(range.start, size_bytes)
    }

    /// Returns the first bytes of a range of the file. They are empty at the end of the file.
    pub(super) fn block(&mut self, range: Range<u64>) -> Result<&[u8], ReadError> {
        self.window.check_stop()?;
        let left = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
        self.window.bytes(range.start, left.min(BLOCK_SIZE_BYTES))
    }

    /// Returns the part that a damaged record spoils: up to the next record, or to the end.
    fn damage(
        &mut self,
        byte: u64,
        cause: String,
        is_cut: bool,
    ) -> Result<FilePart<'_>, ReadError> {
        let next = if self.goes_on { self.find_record(byte + 1)? } else { None };
        if let Some(next) = next {
            self.advance(next)?;
            return Ok(FilePart::Damaged { bytes: byte..next, cause });
        }
        if is_cut {
            return Ok(self.truncated(byte));
        }
        self.is_done = true;
        Ok(FilePart::Damaged { bytes: byte..self.size_bytes(), cause })
    }

    /// Checks the bytes after the footer.
    fn end(&mut self) -> Result<Option<FilePart<'_>>, ReadError> {
        self.is_done = true;
        let (byte, end) = (self.at, self.size_bytes());
        let rest = self.window.bytes(byte, MAGIC.len() + 1)?;
        if rest == MAGIC {
            self.at += MAGIC.len() as u64;
            return Ok(None);
        }
        if rest.starts_with(MAGIC) {
            return Ok(Some(FilePart::AfterEnd { bytes: byte + MAGIC.len() as u64..end }));
        }
        if MAGIC.starts_with(rest) {
            return Ok(Some(FilePart::Truncated { byte }));
        }
        let cause = "the last bytes are not those of an MCAP file".to_owned();
        Ok(Some(FilePart::Damaged { bytes: byte..end, cause }))
    }

    /// Adds the bytes up to a position to the checksum, and continues there. Returns `false` if the file ends before it.
    fn advance(&mut self, to: u64) -> Result<bool, ReadError> {
        while self.at < to {
            let count = usize::try_from(to - self.at).unwrap_or(usize::MAX).min(BLOCK_SIZE_BYTES);
            let block = self.window.bytes(self.at, count)?;
            if block.is_empty() {
                return Ok(false);
            }
            if let Some(section) = &mut self.section {
                section.update(block);
            }
            self.at += block.len() as u64;
        }
        Ok(true)
    }

    /// Returns the position of the next record of a file, from `from` on.
    fn find_record(&mut self, from: u64) -> Result<Option<u64>, ReadError> {
        let mut at = from;
        loop {
            self.window.check_stop()?;
            let block = self.window.bytes(at, BLOCK_SIZE_BYTES)?;
            if block.len() < RECORD_HEADER_SIZE_BYTES {
                return Ok(None);
            }
            let headers = block.windows(RECORD_HEADER_SIZE_BYTES);
            let count = headers.len() as u64;
            let candidates: Vec<u64> = headers
                .enumerate()
                .filter(|(_, header)| is_candidate(header))
                .map(|(offset, _)| at + offset as u64)
                .collect();
            for candidate in candidates {
                if let Form::Record { .. } | Form::Chunk { .. } = self.form(candidate)? {
                    return Ok(Some(candidate));
                }
            }
            at += count;
        }
    }

    /// Examines the bytes at a position.
    fn form(&mut self, byte: u64) -> Result<Form, ReadError> {
        let header = self.window.bytes(byte, RECORD_HEADER_SIZE_BYTES)?;
        let Some((opcode, length)) = split_header(header) else {
            return match header {
                [] => Ok(Form::EndOfFile),
                _ => Ok(wrong("the file ends within a record".to_owned(), true)),
            };
        };
        // A reader that stops at damage needs no record of another program once it knows the run, or in the index.
        let passes_over = !self.goes_on && (self.limits.is_some() || self.section.is_none());
        let is_unknown = (op::DATA_END + 1..PRIVATE_MIN).contains(&opcode);
        if opcode == 0 || is_unknown && !passes_over {
            return Ok(wrong(format!("a record with opcode {opcode}"), false));
        }
        let body = byte + RECORD_HEADER_SIZE_BYTES as u64;
        let mut chunk = None;
        if let (op::CHUNK, Some(limits)) = (opcode, &self.limits) {
            let start_size = usize::try_from(length).unwrap_or(usize::MAX);
            let start_size = start_size.min(CHUNK_START_SIZE_BYTES_MAX);
            let start = self.window.bytes(byte, RECORD_HEADER_SIZE_BYTES + start_size)?;
            let start = start.get(RECORD_HEADER_SIZE_BYTES..).unwrap_or_default();
            match chunk_header(start, length, limits) {
                Ok(header) => chunk = Some(header),
                Err(cause) => return Ok(wrong(cause, start.len() < start_size)),
            }
        }
        let limit = size_bytes_max(opcode, self.limits.as_ref());
        let is_of_others = is_unknown
            || length > limit && !matches!(opcode, op::CHUNK | op::MESSAGE | op::ATTACHMENT);
        // Without a scene, nothing bounds the memory for a chunk.
        let is_skipped = opcode >= PRIVATE_MIN
            || opcode == op::CHUNK && chunk.is_none()
            || is_of_others && passes_over;
        // A reader that stops at damage needs no attachment but the scene before the limits are known.
        let is_skippable = opcode == op::ATTACHMENT && (self.goes_on || self.limits.is_some());
        if length > limit && !is_skippable && !is_skipped {
            let part = match (opcode, &self.limits) {
                (op::MESSAGE, _) => "a message",
                (_, None) => "a record before the first message",
                _ => "a record",
            };
            return Ok(wrong(SizeLimits::exceeded(part, length, limit), false));
        }
        let left = self.size_bytes().saturating_sub(body);
        if length > left {
            return Ok(cut(length, left));
        }
        let size_bytes = length + RECORD_HEADER_SIZE_BYTES as u64;
        if is_skipped {
            return Ok(Form::Skipped { opcode, size_bytes });
        }
        if length > limit {
            let start = self.window.bytes(byte, BLOCK_SIZE_BYTES)?;
            return match LongAttachment::read(byte, size_bytes, start) {
                Some(attachment) => Ok(Form::LongAttachment(attachment)),
                None => Ok(wrong(OTHER_LENGTH.to_owned(), false)),
            };
        }
        let size_bytes = usize::try_from(size_bytes).unwrap_or(usize::MAX);
        let record = self.window.bytes(byte, size_bytes)?;
        if record.len() < size_bytes {
            let left = record.len().saturating_sub(RECORD_HEADER_SIZE_BYTES) as u64;
            return Ok(cut(length, left));
        }
        if let Some((header, start_size)) = chunk {
            return Ok(Form::Chunk { header, start_size, size_bytes });
        }
        match check_fields(opcode, &record[RECORD_HEADER_SIZE_BYTES..]) {
            Ok(0) => Ok(Form::Record { opcode, size_bytes }),
            Ok(_) => Ok(wrong(OTHER_LENGTH.to_owned(), false)),
            Err(cause) => Ok(wrong(cause, false)),
        }
    }
}

const OTHER_LENGTH: &str = "its length is not that of its fields";

/// Returns the form of bytes that are no record. The file may end within it.
fn wrong(cause: String, is_cut: bool) -> Form {
    Form::Wrong { cause, is_cut }
}

/// Returns the form of a record of `length` bytes, of which the file has `left`.
fn cut(length: u64, left: u64) -> Form {
    let cause =
        format!("a record of {length} bytes, but the file ends {left} bytes after its header");
    wrong(cause, true)
}

impl LongAttachment {
    /// Reads the fields before the data from the first bytes of a record. Returns `None` if the
    /// fields do not fill the record.
    fn read(byte: u64, size_bytes: u64, start: &[u8]) -> Option<Self> {
        let mut rest = Unread(start.get(RECORD_HEADER_SIZE_BYTES..)?);
        let header = AttachmentHeader {
            log_time: rest.u64()?,
            create_time: rest.u64()?,
            name: rest.text()?,
            media_type: rest.text()?,
        };
        let data_size = rest.u64()?;
        let data_start = byte + (start.len() - rest.0.len()) as u64;
        let data = data_start..data_start.checked_add(data_size)?;
        let is_exact = data.end.checked_add(size_of::<u32>() as u64)? == byte + size_bytes;
        is_exact.then_some(Self { byte, size_bytes, header, data })
    }
}

/// Returns the opcode and the length of a record.
pub(super) fn split_header(header: &[u8]) -> Option<(u8, u64)> {
    let [opcode, length @ ..] = *header.first_chunk::<RECORD_HEADER_SIZE_BYTES>()?;
    Some((opcode, u64::from_le_bytes(length)))
}

/// Returns `true` if a record that occurs only outside of chunks may begin with these bytes.
fn is_candidate(header: &[u8]) -> bool {
    let is_outside = matches!(
        header[0],
        op::CHUNK
            | op::MESSAGE_INDEX
            | op::CHUNK_INDEX
            | op::ATTACHMENT
            | op::ATTACHMENT_INDEX
            | op::STATISTICS
            | op::METADATA
            | op::METADATA_INDEX
            | op::SUMMARY_OFFSET
            | op::DATA_END
            | op::FOOTER
    );
    // No record of a recording has 4 GiB.
    is_outside && header[5..] == [0; 4]
}

/// Returns the length of the longest record of a kind that is read into memory. The header of a chunk has its own limits.
fn size_bytes_max(opcode: u8, limits: Option<&SizeLimits>) -> u64 {
    match (opcode, limits) {
        (op::CHUNK | PRIVATE_MIN.., _) => u64::MAX,
        (op::MESSAGE, Some(limits)) => limits.record_size_bytes_max(),
        (op::ATTACHMENT, _) => HEADER_RECORD_SIZE_BYTES_MAX,
        (op::MESSAGE_INDEX | op::STATISTICS, _) => INDEX_SIZE_BYTES_MAX,
        _ => TEXT_SIZE_BYTES_MAX,
    }
}
