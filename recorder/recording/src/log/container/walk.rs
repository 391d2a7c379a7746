//! A walk over the records of a file, which goes on behind damage.
//!
//! Every record has a form that its length must match exactly, so a wrong length is noticed at its own
//! record. Behind a damaged record, the walk searches byte by byte for the next record of a file. It
//! does not accept records that also occur within chunks, or it would read the content of an
//! uncompressed chunk as if no checksum belonged to it.

use std::io::{Read, Seek};
use std::ops::Range;

use crc32fast::Hasher;
use mcap::MAGIC;
use mcap::records::{Record, op};

use super::attachment::{Checksum, LongAttachment};
use super::chunk::is_chunk;
use super::finding::AfterEnd;
use super::window::Window;
use crate::log::read::lengths::is_exact;
use crate::log::read::limits::{
    HEADER_RECORD_SIZE_BYTES_MAX, RECORD_HEADER_SIZE_BYTES, SizeLimits, TEXT_SIZE_BYTES_MAX,
};
use crate::log::read::read_error::ReadError;

/// Longest record of an index: one entry of 16 bytes for each message of a chunk. A message has at
/// least 31 bytes.
const INDEX_SIZE_BYTES_MAX: u64 = 8 << 20;
/// Bytes to examine or to add to a checksum at a time.
const BLOCK_SIZE_BYTES: usize = 1 << 20;
/// Opcodes from here on are those of private records.
const PRIVATE_MIN: u8 = 0x80;

/// A part of a file.
#[derive(Debug)]
pub(super) enum Part<'a> {
    /// A record whose form is intact.
    Record { byte: u64, opcode: u8, body: &'a [u8] },
    /// An attachment that is too long for memory.
    LongAttachment { attachment: LongAttachment, checksum: Checksum },
    /// A record that is not read: a private record, or a chunk before the description of the run.
    Skipped { byte: u64, opcode: u8 },
    /// Bytes that are no records.
    Damaged { bytes: Range<u64>, cause: String },
    /// The file ends within a record, or before its end.
    Truncated { byte: u64 },
    /// Other bytes follow the end of the recording, such as a second file.
    AfterEnd { bytes: Range<u64> },
}

/// The form of the bytes at a position.
enum Form {
    Record { opcode: u8, size_bytes: usize },
    LongAttachment(LongAttachment),
    Skipped { opcode: u8, size_bytes: u64 },
    EndOfFile,
    Wrong { cause: String, is_cut: bool },
}

/// A walk over the records of a file.
pub(super) struct Walk<R> {
    window: Window<R>,
    /// Position of the next record.
    at: u64,
    limits: Option<SizeLimits>,
    /// The checksum of the current section up to `at`.
    section: Hasher,
    /// The checksum of the section without its last record.
    section_before: u32,
    is_after_footer: bool,
    is_done: bool,
}

impl<R: Read + Seek> Walk<R> {
    /// Begins after the magic of a file.
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
            section,
            section_before: 0,
            is_after_footer: false,
            is_done: false,
        })
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

    /// Returns the checksum of the section before the record that was read last.
    pub(super) fn checksum_before(&self) -> u32 {
        self.section_before
    }

    /// Returns the checksum of the section up to the footer's own checksum. `footer` is its body.
    pub(super) fn summary_checksum(&self, footer_record: &[u8]) -> u32 {
        let mut hasher = Hasher::new_with_initial(self.section_before);
        hasher.update(footer_record);
        hasher.finalize()
    }

    /// Starts the next section, after its first record was read.
    pub(super) fn restart_checksum(&mut self) {
        self.section = Hasher::new();
    }

    /// Returns the next part, or `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Part<'_>>, ReadError> {
        self.window.check_stop()?;
        if self.is_done {
            return Ok(None);
        }
        if self.is_after_footer {
            return self.end();
        }
        let byte = self.at;
        match self.form(byte, self.limits)? {
            Form::Record { opcode, size_bytes } => self.record(byte, opcode, size_bytes).map(Some),
            Form::Skipped { opcode, size_bytes } => {
                self.section_before = self.section.clone().finalize();
                self.advance(byte + size_bytes)?;
                Ok(Some(Part::Skipped { byte, opcode }))
            }
            Form::LongAttachment(attachment) => self.long_attachment(attachment).map(Some),
            Form::EndOfFile => {
                self.is_done = true;
                Ok(Some(Part::Truncated { byte }))
            }
            Form::Wrong { cause, is_cut } => self.damage(byte, cause, is_cut).map(Some),
        }
    }

    fn record(&mut self, byte: u64, opcode: u8, size_bytes: usize) -> Result<Part<'_>, ReadError> {
        let record = self.window.bytes(byte, size_bytes)?;
        // Only these two compare it.
        if matches!(opcode, op::DATA_END | op::FOOTER) {
            self.section_before = self.section.clone().finalize();
        }
        self.section.update(record);
        self.at = byte + size_bytes as u64;
        self.is_after_footer = opcode == op::FOOTER;
        Ok(Part::Record { byte, opcode, body: &record[RECORD_HEADER_SIZE_BYTES..] })
    }

    /// Compares a long attachment with its checksum, in pieces.
    fn long_attachment(&mut self, attachment: LongAttachment) -> Result<Part<'_>, ReadError> {
        let mut hasher = Hasher::new();
        let LongAttachment { byte, size_bytes, data, .. } = &attachment;
        let mut at = byte + RECORD_HEADER_SIZE_BYTES as u64;
        self.advance(at)?;
        while at < data.end {
            let block = self.block(at..data.end)?;
            hasher.update(block);
            at += block.len() as u64;
            self.advance(at)?;
        }
        let saved = self.window.bytes(data.end, size_of::<u32>())?;
        let checksum = match u32::from_le_bytes(saved.try_into().map_err(|_| cut_while_read())?) {
            0 => Checksum::Missing,
            saved if saved == hasher.finalize() => Checksum::Right,
            _ => Checksum::Wrong,
        };
        self.advance(byte + size_bytes)?;
        Ok(Part::LongAttachment { attachment, checksum })
    }

    /// Returns the first bytes of a range of the file.
    pub(super) fn block(&mut self, range: Range<u64>) -> Result<&[u8], ReadError> {
        self.window.check_stop()?;
        let left = usize::try_from(range.end - range.start).unwrap_or(usize::MAX);
        let block = self.window.bytes(range.start, left.min(BLOCK_SIZE_BYTES))?;
        if block.is_empty() { Err(cut_while_read().into()) } else { Ok(block) }
    }

    /// Returns the part that a damaged record spoils: up to the next record, or to the end.
    fn damage(&mut self, byte: u64, cause: String, is_cut: bool) -> Result<Part<'_>, ReadError> {
        match self.find_record(byte + 1)? {
            Some(next) => {
                self.advance(next)?;
                Ok(Part::Damaged { bytes: byte..next, cause })
            }
            None if is_cut => {
                self.is_done = true;
                Ok(Part::Truncated { byte })
            }
            None => {
                let end = self.size_bytes();
                self.is_done = true;
                Ok(Part::Damaged { bytes: byte..end, cause })
            }
        }
    }

    /// Checks the bytes after the footer.
    fn end(&mut self) -> Result<Option<Part<'_>>, ReadError> {
        self.is_done = true;
        let (byte, end) = (self.at, self.size_bytes());
        let rest = self.window.bytes(byte, MAGIC.len() + 1)?;
        if rest == MAGIC {
            return Ok(None);
        }
        if rest.starts_with(MAGIC) {
            return Ok(Some(Part::AfterEnd { bytes: byte + MAGIC.len() as u64..end }));
        }
        if MAGIC.starts_with(rest) {
            return Ok(Some(Part::Truncated { byte }));
        }
        let cause = "the last bytes are not those of an MCAP file".to_owned();
        Ok(Some(Part::Damaged { bytes: byte..end, cause }))
    }

    /// Reads the bytes after the end to count their messages.
    pub(super) fn read_after_end(&mut self, bytes: &Range<u64>) -> Result<AfterEnd, ReadError> {
        let (byte, size_bytes) = (bytes.start, bytes.end - bytes.start);
        let mut found = AfterEnd { byte, size_bytes, ..AfterEnd::default() };
        let mut begin = Some(byte);
        while let Some(at) = begin.take() {
            (self.at, self.is_done, self.is_after_footer) = (at, false, false);
            while let Some(part) = self.next()? {
                match part {
                    Part::Record { opcode: op::CHUNK, .. } => found.chunk_count += 1,
                    Part::Record { opcode: op::MESSAGE, .. } => found.message_count += 1,
                    Part::Record { opcode: op::MESSAGE_INDEX, body, .. } => {
                        found.message_count += index_entry_count(body);
                    }
                    // A third file.
                    Part::AfterEnd { bytes } => begin = Some(bytes.start),
                    _ => {}
                }
            }
        }
        Ok(found)
    }

    /// Adds the bytes up to a position to the checksum, and continues there.
    fn advance(&mut self, to: u64) -> Result<(), ReadError> {
        while self.at < to {
            let count = usize::try_from(to - self.at).unwrap_or(usize::MAX).min(BLOCK_SIZE_BYTES);
            let block = self.window.bytes(self.at, count)?;
            if block.is_empty() {
                return Ok(());
            }
            self.section.update(block);
            self.at += block.len() as u64;
        }
        Ok(())
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
                if let Form::Record { .. } = self.form(candidate, self.limits)? {
                    return Ok(Some(candidate));
                }
            }
            at += count;
        }
    }

    /// Examines the bytes at a position.
    fn form(&mut self, byte: u64, limits: Option<SizeLimits>) -> Result<Form, ReadError> {
        let left = self.size_bytes() - byte;
        let header = self.window.bytes(byte, RECORD_HEADER_SIZE_BYTES)?;
        let Some((opcode, length)) = split_header(header) else {
            let is_empty = header.is_empty();
            let cause = "the file ends within a record".to_owned();
            return Ok(if is_empty {
                Form::EndOfFile
            } else {
                Form::Wrong { cause, is_cut: true }
            });
        };
        let wrong = |cause: String, is_cut| Ok(Form::Wrong { cause, is_cut });
        if opcode == 0 || (op::DATA_END + 1..PRIVATE_MIN).contains(&opcode) {
            return wrong(format!("no record has opcode {opcode}"), false);
        }
        let size_bytes = length.saturating_add(RECORD_HEADER_SIZE_BYTES as u64);
        if size_bytes > left {
            let cause = format!("a record of {size_bytes} bytes, of which the file has {left}");
            return wrong(cause, true);
        }
        let limit = size_bytes_max(opcode, limits);
        // Without a scene, nothing bounds the memory for a chunk.
        let is_early_chunk = opcode == op::CHUNK && limits.is_none();
        let is_long_attachment = opcode == op::ATTACHMENT && length > limit;
        if is_long_attachment {
            let start = self.window.bytes(byte, BLOCK_SIZE_BYTES)?;
            return match LongAttachment::read(byte, size_bytes, start) {
                Some(attachment) => Ok(Form::LongAttachment(attachment)),
                None => wrong("its length is not that of its fields".to_owned(), false),
            };
        }
        if opcode >= PRIVATE_MIN || is_early_chunk {
            return Ok(Form::Skipped { opcode, size_bytes });
        }
        if length > limit {
            return wrong(format!("a record of {length} bytes (allowed: up to {limit})"), false);
        }
        let size_bytes = usize::try_from(size_bytes).unwrap_or(usize::MAX);
        let record = self.window.bytes(byte, size_bytes)?;
        let body = record.get(RECORD_HEADER_SIZE_BYTES..).unwrap_or(&[]);
        let is_right = match (opcode, &limits) {
            (op::CHUNK, Some(limits)) => is_chunk(body, limits),
            _ if is_exact(opcode, body) => Ok(()),
            _ => Err("its length is not that of its fields".to_owned()),
        };
        match is_right {
            Ok(()) => Ok(Form::Record { opcode, size_bytes }),
            Err(cause) => wrong(cause, false),
        }
    }
}

/// Returns the number of messages in a message index, whose length is exact.
fn index_entry_count(body: &[u8]) -> u64 {
    match mcap::parse_record(op::MESSAGE_INDEX, body) {
        Ok(Record::MessageIndex(index)) => index.records.len() as u64,
        _ => 0,
    }
}

/// Returns the error of a file that became shorter while it was read.
fn cut_while_read() -> std::io::Error {
    std::io::ErrorKind::UnexpectedEof.into()
}

/// Returns the opcode and the length of a record.
fn split_header(header: &[u8]) -> Option<(u8, u64)> {
    let (opcode, length) = header.split_first()?;
    Some((*opcode, u64::from_le_bytes(length.try_into().ok()?)))
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

/// Returns the length of the longest record of a kind.
fn size_bytes_max(opcode: u8, limits: Option<SizeLimits>) -> u64 {
    match (opcode, limits) {
        (op::CHUNK, Some(limits)) => limits.chunk_record_size_bytes_max(),
        (op::MESSAGE, Some(limits)) => limits.record_size_bytes_max(),
        (op::ATTACHMENT, _) => HEADER_RECORD_SIZE_BYTES_MAX,
        (op::MESSAGE_INDEX | op::STATISTICS, _) => INDEX_SIZE_BYTES_MAX,
        _ => TEXT_SIZE_BYTES_MAX,
    }
}
