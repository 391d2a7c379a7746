//! The repair of a file: everything that is intact, with a new index and all losses declared.
//!
//! The scanner goes on behind damage, chunks count only with a correct checksum, and messages only if they
//! pass the checks of `recorder check`. A snapshot is kept with its row or not at all. So the result is
//! sound, and says what it lacks: message counts in the metadata `recorder`, and ranges of steps in the
//! metadata `repair`.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Seek, Write};
use std::ops::Range;

use mcap::records::{MessageIndex, Metadata, Record, op};
use mcap::{Attachment, MAGIC};
use sim_messages::StopFlag;

use super::check::WRONG_CHECKSUM;
use super::finding::{AfterEnd, Findings, RepairReport, record_name};
use super::head::FileHead;
use super::losses::{LOST_SCENE, LOST_SELECTION};
use super::lost_load::LoadRows;
use super::places::Places;
use super::repair_writer::{Format, RepairWriter, size_in_memory};
use crate::log::read_error::ReadError;
use crate::log::run::{CLOSING_METADATA, Closing, SCENE_ATTACHMENT, header_library};
use crate::log::scanner::chunk::{Chunk, ChunkContent, InnerRecords};
use crate::log::scanner::limits::HEADER_RECORD_SIZE_BYTES_MAX;
use crate::log::scanner::window::Window;
use crate::log::scanner::{Checksum, FilePart, LongAttachment, RecordScanner};
use crate::log::topic::Topic;
use crate::log::writer::WriteError;

/// Bytes between two calls of the progress callback.
const PROGRESS_PERIOD_BYTES: u64 = 16 << 20;

/// Most memory of the records before the metadata `run`: a scene, and as much again.
const HEAD_SIZE_BYTES_MAX: u64 = 2 * HEADER_RECORD_SIZE_BYTES_MAX;
/// The reason why a file could not be repaired.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// The input cannot be read, or has no readable description of its run.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Copies the intact part of a recording. Calls `on_progress` with the position and the size of the input.
/// `load` is written if the first chunk, which has it, is lost: see [`RepairReport::lost_load`].
///
/// # Errors
/// If the input is not a recording, the operating system reports an error, or a signal has arrived. The
/// output then has no end.
pub fn repair_file<R: Read + Seek, W: Write>(
    source: R,
    out: W,
    load: Option<LoadRows>,
    stop: Option<&StopFlag>,
    on_progress: &mut dyn FnMut(u64, u64),
) -> Result<RepairReport, RepairError> {
    let mut scanner = RecordScanner::new(Window::new(source, stop.cloned())?)?;
    let mut repair = Repair { load, ..Repair::new(scanner.size_bytes(), out) };
    let mut chunks = ChunkContent::default();
    let mut next_progress = 0;
    loop {
        if scanner.position() >= next_progress {
            on_progress(scanner.position(), scanner.size_bytes());
            next_progress = scanner.position() + PROGRESS_PERIOD_BYTES;
        }
        match scanner.next()? {
            None => break,
            Some(FilePart::LongAttachment { attachment, checksum }) => {
                repair.add_long_attachment(&mut scanner, attachment, checksum)?;
            }
            Some(FilePart::AfterEnd { bytes }) => {
                repair.after_end = Some(read_after_end(&mut scanner, &bytes)?);
            }
            Some(part) => repair.add(part, &mut chunks)?,
        }
        repair.file_head.pass_limits(&mut scanner);
    }
    repair.finish()
}

/// Reads the bytes after the end to count their messages.
fn read_after_end<R: Read>(
    scanner: &mut RecordScanner<R>,
    bytes: &Range<u64>,
) -> Result<AfterEnd, ReadError> {
    let (byte, size_bytes) = (bytes.start, bytes.end - bytes.start);
    let mut found = AfterEnd { byte, size_bytes, ..AfterEnd::default() };
    let mut begin = Some(byte);
    while let Some(at) = begin.take() {
        scanner.go_to(at);
        while let Some(part) = scanner.next()? {
            match part {
                FilePart::Chunk { .. } => found.chunk_count += 1,
                FilePart::Record { opcode: op::MESSAGE, .. } => found.message_count += 1,
                FilePart::Record { opcode: op::MESSAGE_INDEX, body, .. } => {
                    if let Ok(Record::MessageIndex(index)) =
                        mcap::parse_record(op::MESSAGE_INDEX, body)
                    {
                        found.message_count += index.records.len() as u64;
                    }
                }
                // A third file.
                FilePart::AfterEnd { bytes } => begin = Some(bytes.start),
                _ => {}
            }
        }
    }
    Ok(found)
}

/// The section of the input that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Data,
    /// The message indexes of a damaged chunk follow.
    AfterBadChunk,
    /// Records follow that may belong to a chunk that is not readable as one.
    AfterDamage,
    /// The index, which is rewritten.
    Index,
}

/// The state of a repair.
struct Repair<W: Write> {
    /// Size of the input.
    size_bytes: u64,
    findings: Findings,
    format: Format,
    file_head: FileHead,
    scene: Option<Vec<u8>>,
    /// The load to write if the input has lost it.
    load: Option<LoadRows>,
    /// The messages of the last chunk, to compare its message indexes with.
    places: Places,
    /// Numbers of lost messages by channel, before any channel is declared.
    undeclared: BTreeMap<u16, u64>,
    /// Numbers of messages by channel, as the index of the file has them.
    indexed: Option<BTreeMap<u16, u64>>,
    /// Attachments and metadata before the first chunk.
    head: Vec<Record<'static>>,
    head_size_bytes: u64,
    /// A part before the metadata `run` is left out.
    is_head_damaged: bool,
    /// The output, until it is created.
    out: Option<W>,
    writer: Option<RepairWriter<W>>,
    section: Section,
    has_wrong_checksum: bool,
    /// The checksum of the data is wrong, and no finding in them tells why.
    is_unexplained: bool,
    first_step: Option<u64>,
    after_end: Option<AfterEnd>,
}

impl<W: Write> Repair<W> {
    fn new(size_bytes: u64, out: W) -> Self {
        Self {
            size_bytes,
            findings: Findings::default(),
            format: Format::default(),
            file_head: FileHead::default(),
            scene: None,
            load: None,
            places: Places::default(),
            undeclared: BTreeMap::new(),
            indexed: None,
            head: Vec::new(),
            head_size_bytes: 0,
            is_head_damaged: false,
            out: Some(out),
            writer: None,
            section: Section::Data,
            has_wrong_checksum: false,
            is_unexplained: false,
            first_step: None,
            after_end: None,
        }
    }

    /// Adds a part of the input.
    fn add(&mut self, part: FilePart<'_>, chunks: &mut ChunkContent) -> Result<(), RepairError> {
        match part {
            FilePart::Record { byte, opcode, body, section } => {
                // A second end of the data lies in the index.
                let ends_data = opcode == op::DATA_END && self.section != Section::Index;
                self.add_record(byte, opcode, body)?;
                if let Some(section) = section.filter(|_| ends_data) {
                    self.has_wrong_checksum = section.is_wrong();
                    self.is_unexplained = section.is_wrong() && self.findings.count() == 0;
                }
            }
            FilePart::Chunk { .. } if self.section == Section::Index => {}
            FilePart::Chunk { byte, size_bytes, chunk } => {
                self.add_chunk(byte, size_bytes, &chunk, chunks)?;
            }
            FilePart::Skipped { opcode: op::CHUNK, .. } => {
                return Err(self.file_head.no_run(&self.findings).into());
            }
            // The attachment is copied in pieces, the bytes are only counted.
            FilePart::LongAttachment { .. } | FilePart::AfterEnd { .. } => {}
            FilePart::Skipped { byte, opcode } => {
                self.lose(byte, record_name(opcode), "it is of another program")?;
                // The opcode may be the damage.
                self.begin_damage();
            }
            FilePart::Damaged { bytes, cause } => {
                let size_bytes = bytes.end - bytes.start;
                let what = format!("{size_bytes} bytes are damaged: {cause}");
                self.file_head.add_damage(size_bytes);
                self.lose(bytes.start, "damaged record", &what)?;
                self.begin_damage();
            }
            // A killed recorder leaves whole records.
            FilePart::Truncated { byte } if byte == self.size_bytes => {
                self.findings.add_index(byte, "end of the file", "the file has no end");
            }
            FilePart::Truncated { byte } => {
                self.lose(byte, "end of the file", "the file is truncated here")?;
            }
        }
        Ok(())
    }

    /// The message indexes of an unreadable chunk may follow.
    fn begin_damage(&mut self) {
        if self.section != Section::Index {
            self.section = Section::AfterDamage;
        }
    }

    /// Reports a part that is left out. The index is rewritten, so nothing of it is lost.
    fn lose(&mut self, byte: u64, record: &str, what: &str) -> Result<(), RepairError> {
        if self.section == Section::Index {
            self.findings.add_index(byte, record, what);
            return Ok(());
        }
        self.findings.add(byte, record, what);
        if self.file_head.content.is_some() {
            self.begin()?;
        }
        match (&mut self.writer, &mut self.file_head.content) {
            (Some(writer), Some(content)) => writer.mark_gap(content),
            _ => self.is_head_damaged = true,
        }
        Ok(())
    }

    fn add_record(&mut self, byte: u64, opcode: u8, body: &[u8]) -> Result<(), RepairError> {
        if self.section == Section::Index {
            if let Ok(Record::Statistics(statistics)) = mcap::parse_record(opcode, body) {
                self.indexed = Some(statistics.channel_message_counts);
            }
            return Ok(());
        }
        let record = match mcap::parse_record(opcode, body) {
            Ok(record) => record,
            Err(error) => {
                self.file_head.add_damage(body.len() as u64);
                return self.lose(byte, record_name(opcode), &error.to_string());
            }
        };
        match record {
            Record::DataEnd(_) | Record::Footer(_) => self.section = Section::Index,
            Record::Header(header) => self.file_head.library = header.library,
            Record::MessageIndex(index) => self.add_message_index(byte, &index)?,
            Record::Metadata(metadata) => self.add_metadata(byte, metadata)?,
            Record::Attachment { header, data, crc } => {
                if self.file_head.is_scene(&header.name) {
                    self.file_head.add_scene(data.len());
                    self.scene = Some(data.to_vec());
                }
                let data = Cow::Owned(data.into_owned());
                self.add_head(byte, Record::Attachment { header, data, crc })?;
            }
            other => self.add_content_record(byte, "record", &other)?,
        }
        Ok(())
    }

    fn add_metadata(&mut self, byte: u64, metadata: Metadata) -> Result<(), RepairError> {
        self.file_head.add_metadata(&metadata)?;
        // The output has an end of its own.
        if metadata.name == CLOSING_METADATA {
            return Ok(());
        }
        self.add_head(byte, Record::Metadata(metadata))
    }

    /// Copies an attachment or a metadata record. Those before the first chunk wait for its compression,
    /// as long as they need little memory.
    fn add_head(&mut self, byte: u64, record: Record<'static>) -> Result<(), RepairError> {
        if self.writer.is_some() {
            return Ok(self.copy_head(&record)?);
        }
        let sum = self.head_size_bytes.saturating_add(size_in_memory(&record));
        if self.file_head.content.is_none() && sum > HEAD_SIZE_BYTES_MAX {
            let what = "the records before the metadata 'run' are too long";
            return self.lose(byte, record_name(record.opcode()), what);
        }
        self.head_size_bytes = sum;
        self.head.push(record);
        if self.file_head.content.is_some() && sum > HEADER_RECORD_SIZE_BYTES_MAX {
            self.begin()?;
        }
        Ok(())
    }

    fn copy_head(&mut self, record: &Record<'static>) -> Result<(), WriteError> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        match record {
            Record::Attachment { header, data, .. } => writer.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name.clone(),
                media_type: header.media_type.clone(),
                data: Cow::Borrowed(data),
            }),
            Record::Metadata(metadata) => writer.write_metadata(metadata),
            _ => Ok(()),
        }
    }

    /// Creates the output.
    fn begin(&mut self) -> Result<(), RepairError> {
        let Some(out) = self.out.take() else { return Ok(()) };
        self.restore_header();
        let writer = self.writer.insert(RepairWriter::create(out, &self.format)?);
        if self.is_head_damaged {
            let is_scene = |one: &Record<'_>| matches!(one, Record::Attachment { header, .. } if header.name == SCENE_ATTACHMENT);
            let what = if self.head.iter().any(is_scene) { LOST_SELECTION } else { LOST_SCENE };
            writer.losses.lose_head(what);
        }
        for record in std::mem::take(&mut self.head) {
            self.copy_head(&record)?;
        }
        Ok(())
    }

    /// Rebuilds the file header from the run metadata, because no checksum protects the input's header.
    fn restore_header(&mut self) {
        let Some(content) = &self.file_head.content else { return };
        let own = header_library(&content.run().recorder_version);
        let found = std::mem::take(&mut self.file_head.library);
        if !found.is_empty() && !found.starts_with(&own) {
            let what = format!("its library is '{found}', not that of '{}'", own.trim_end());
            self.findings.add_index(MAGIC.len() as u64, "header", what);
        }
        self.format.library = own + mcap::LIBRARY_IDENTIFIER;
    }

    fn add_chunk(
        &mut self,
        byte: u64,
        size_bytes: usize,
        chunk: &Chunk<'_>,
        chunks: &mut ChunkContent,
    ) -> Result<(), RepairError> {
        if self.writer.is_none() {
            self.format.compression = Some(chunk.header.compression.clone());
        }
        self.begin()?;
        if let Err(cause) = chunks.read(chunk) {
            self.section = Section::AfterBadChunk;
            self.declare_channels()?;
            return self.lose(byte, "chunk", &cause);
        }
        self.section = Section::Data;
        self.places.begin_chunk(byte, size_bytes as u64, &chunk.header);
        for inner in InnerRecords::from(chunks.of(chunk.data), 0) {
            match inner.and_then(|inner| inner.parse().map(|record| (record, inner.offset))) {
                Ok((record, offset)) => {
                    if let Record::Message { header, .. } = &record {
                        self.places.add_message(header, offset);
                    }
                    self.add_content_record(byte, "chunk", &record)?;
                }
                Err(what) => self.lose(byte, "chunk", &what)?,
            }
        }
        Ok(())
    }

    /// Copies a long attachment in pieces. No message is missing without it.
    fn add_long_attachment<R: Read>(
        &mut self,
        scanner: &mut RecordScanner<R>,
        attachment: LongAttachment,
        checksum: Checksum,
    ) -> Result<(), RepairError> {
        let LongAttachment { byte, header, data, .. } = attachment;
        if self.file_head.content.is_none() {
            let what = "it is too long to stand before the metadata 'run'";
            return self.lose(byte, "attachment", what);
        }
        self.begin()?;
        let Some(writer) = &mut self.writer else { return Ok(()) };
        if checksum == Checksum::Wrong {
            self.findings.add(byte, "attachment", WRONG_CHECKSUM);
            writer.losses.add_attachment();
            return Ok(());
        }
        writer.start_attachment(data.end - data.start, header)?;
        let mut at = data.start;
        while at < data.end {
            let block = scanner.block(at..data.end)?;
            if block.is_empty() {
                // The file became shorter while it was read.
                return Err(ReadError::Io(ErrorKind::UnexpectedEof.into()).into());
            }
            writer.put_attachment_bytes(block)?;
            at += block.len() as u64;
        }
        Ok(writer.finish_attachment()?)
    }

    /// Copies a schema, a channel or a message.
    fn add_content_record(
        &mut self,
        byte: u64,
        place: &str,
        record: &Record<'_>,
    ) -> Result<(), RepairError> {
        if self.file_head.content.is_none() {
            return Err(self.file_head.no_run(&self.findings).into());
        }
        self.begin()?;
        if matches!(record, Record::Message { .. }) {
            self.declare_lost_channels()?;
        }
        let (Some(writer), Some(content)) = (&mut self.writer, &mut self.file_head.content) else {
            return Ok(());
        };
        let result = match record {
            Record::Schema { header, data } => writer.add_schema(header, data)?,
            Record::Channel(channel) => match writer.add_channel(channel)? {
                Ok(()) => content.add_channel(channel),
                conflict => conflict,
            },
            Record::Message { header, data } => {
                let result = writer.add_message(header, data, content)?;
                if let Some(step) = writer.take_dropped_row() {
                    let what = format!("step {step}: its snapshot is missing");
                    self.findings.add(byte, place, what);
                }
                self.first_step = self.first_step.or(content.last_row().map(|row| row.step));
                result
            }
            other => Err(format!("a {} does not belong here", record_name(other.opcode()))),
        };
        if let Err(what) = result {
            self.findings.add(byte, place, what);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<RepairReport, RepairError> {
        if self.file_head.content.is_none() {
            return Err(self.file_head.no_run(&self.findings).into());
        }
        self.begin()?;
        if !self.undeclared.is_empty() {
            self.declare_lost_channels()?;
        }
        let closing = self.file_head.closing.take().map(|closing| self.without_damage(closing));
        let (Some(writer), Some(mut content)) = (self.writer.take(), self.file_head.content.take())
        else {
            return Err(WriteError::Stopped.into());
        };
        let mut metadata = BTreeMap::from([
            ("recorder_version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("source_size_bytes".to_owned(), self.size_bytes.to_string()),
            ("finding_count".to_owned(), self.findings.count().to_string()),
        ]);
        let has_end = closing.is_some();
        let (_, losses) = writer.finish(closing, &mut content, &mut metadata)?;
        let last = content.last_row().map(|row| row.step);
        Ok(RepairReport {
            is_uncertain: self.is_unexplained && losses.is_empty(),
            findings: self.findings,
            counts: content.counts,
            steps: self.first_step.zip(last).map(|(first, last)| [first, last]),
            losses,
            lost_load: content.lost_load(),
            has_end,
            after_end: self.after_end,
            scene: self.scene,
        })
    }
}

impl<W: Write> Repair<W> {
    /// Compares a message index with its chunk, or counts the messages of a damaged chunk.
    fn add_message_index(&mut self, byte: u64, index: &MessageIndex) -> Result<(), RepairError> {
        // Its size and place matter only for the index of the file, which is rewritten.
        match self.section {
            Section::Data => {
                if self.places.has_chunk()
                    && let Err(what) = self.places.check_message_index(byte, 0, index)
                {
                    self.findings.add_index(byte, "message index", what);
                }
                return Ok(());
            }
            // The index may belong to the last intact chunk, whose messages are not lost.
            Section::AfterDamage if self.places.check_message_index(byte, 0, index).is_ok() => {
                return Ok(());
            }
            _ => {}
        }
        let (channel_id, count) = (index.channel_id, index.records.len() as u64);
        if self.file_head.content.is_some() {
            self.begin()?;
        }
        match (&mut self.writer, &self.file_head.content) {
            (Some(writer), Some(content)) if content.has_channels() => {
                writer.losses.add_indexed(content.topic(channel_id), count);
            }
            _ => *self.undeclared.entry(channel_id).or_default() += count,
        }
        Ok(())
    }

    /// Declares the channels as a recorder does, if the first chunk, which declares them, is lost. Nothing is known then
    /// of what it had.
    fn declare_lost_channels(&mut self) -> Result<(), WriteError> {
        self.declare_channels()?;
        let (Some(writer), Some(content)) = (&mut self.writer, &self.file_head.content) else {
            return Ok(());
        };
        for (channel_id, count) in std::mem::take(&mut self.undeclared) {
            writer.losses.add_indexed(content.topic(channel_id), count);
        }
        Ok(())
    }

    /// Declares the channels as a recorder does, if none is declared.
    fn declare_channels(&mut self) -> Result<(), WriteError> {
        let (Some(writer), Some(content)) = (&mut self.writer, &mut self.file_head.content) else {
            return Ok(());
        };
        if content.has_channels() {
            return Ok(());
        }
        writer.mark_gap(content);
        writer.declare_channels(content, self.load.take())
    }

    /// Removes the numbers of written messages that the index of the file contradicts, if a byte of the data is
    /// wrong: it may be theirs.
    fn without_damage(&self, mut closing: Closing) -> Closing {
        let (Some(indexed), Some(content)) = (&self.indexed, &self.file_head.content) else {
            return closing;
        };
        if !self.has_wrong_checksum {
            return closing;
        }
        for topic in Topic::ALL {
            let of_topic = indexed.iter().filter(|(id, _)| content.topic(**id) == Some(topic));
            let count: u64 = of_topic.map(|(_, count)| count).sum();
            if closing.counts[topic].written != count {
                closing.counts[topic].written = 0;
            }
        }
        closing
    }
}
