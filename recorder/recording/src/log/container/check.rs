//! The check of a whole file: structure, checksums, index, messages and hashes.

use std::collections::BTreeSet;
use std::io::{Read, Seek};

use mcap::records::{Channel, MessageHeader, Record, op};
use sim_messages::StopFlag;

use super::content::ContentCheck;
use super::finding::{CheckExtent, CheckReport, Findings, after_end_text, record_name};
use super::head::FileHead;
use super::places::{Places, SummaryCheck, is_of_index};
use crate::log::read_error::ReadError;
use crate::log::scanner::chunk::{Chunk, ChunkContent, InnerRecords};
use crate::log::scanner::limits::RECORD_HEADER_SIZE_BYTES;
use crate::log::scanner::window::Window;
use crate::log::scanner::{Checksum, FilePart, LongAttachment, RecordScanner, SectionChecksum};
use crate::log::topic::Topic;

/// Bytes between two calls of the progress callback.
const PROGRESS_PERIOD_BYTES: u64 = 16 << 20;

/// Finding about an attachment with other bytes than its writer wrote.
pub(super) const WRONG_CHECKSUM: &str = "its checksum is wrong";

/// Most parts of other programs that a report names.
const NOT_CHECKED_MAX: usize = 16;

/// Checks every byte of a file. Calls `on_progress` with the position and the size of the file.
///
/// # Errors
/// If the operating system reports an error, a signal has arrived, or the file is not a recording.
pub fn check_file<R: Read + Seek>(
    source: R,
    stop: Option<&StopFlag>,
    on_progress: &mut dyn FnMut(u64, u64),
) -> Result<CheckReport, ReadError> {
    let mut scanner = RecordScanner::new(Window::new(source, stop.cloned())?)?;
    let mut check = Check::default();
    let mut chunks = ChunkContent::default();
    let mut next_progress = 0;
    loop {
        if scanner.position() >= next_progress {
            on_progress(scanner.position(), scanner.size_bytes());
            next_progress = scanner.position() + PROGRESS_PERIOD_BYTES;
        }
        let Some(part) = scanner.next()? else { break };
        check.add(part, &mut chunks)?;
        check.head.pass_limits(&mut scanner);
    }
    check.finish(scanner.size_bytes())
}

/// The record of the file that holds a message.
#[derive(Debug, Clone, Copy)]
struct InFile {
    byte: u64,
    record: &'static str,
}

/// The state of a check.
#[derive(Default)]
struct Check {
    findings: Findings,
    extent: CheckExtent,
    head: FileHead,
    has_header: bool,
    first_step: Option<u64>,
    places: Places,
    /// A part of the file is damaged, so its index and its counts differ from the rest.
    has_damage: bool,
    /// Channels without a declaration, which are reported once.
    undeclared: BTreeSet<u16>,
    /// `None` before the end of the data.
    summary: Option<SummaryCheck>,
}

impl Check {
    /// Checks a part of the file.
    fn add(&mut self, part: FilePart<'_>, chunks: &mut ChunkContent) -> Result<(), ReadError> {
        match part {
            FilePart::Record { byte, opcode, body, section } => {
                self.end_message_indexes(byte, opcode);
                self.add_record(byte, opcode, body)?;
                if let Some(section) = section {
                    self.end_section(byte, opcode, section);
                }
            }
            FilePart::Chunk { byte, size_bytes, chunk } => {
                self.end_message_indexes(byte, op::CHUNK);
                self.add_chunk(byte, size_bytes, &chunk, chunks);
            }
            FilePart::Skipped { opcode: op::CHUNK, .. } => {
                return Err(self.head.no_run(&self.findings));
            }
            FilePart::Skipped { byte, opcode } => {
                self.not_checked(format!("the {} at byte {byte}", record_name(opcode)));
            }
            FilePart::LongAttachment { attachment, checksum } => {
                let LongAttachment { byte, size_bytes, header, data } = attachment;
                if checksum == Checksum::Wrong {
                    self.findings.add(byte, "attachment", WRONG_CHECKSUM);
                }
                if checksum == Checksum::Missing {
                    self.not_checked(no_checksum(&header.name));
                }
                self.places.add_attachment(byte, size_bytes, &header, data.end - data.start);
            }
            FilePart::Damaged { bytes, cause } => {
                let what = format!("{} bytes are damaged: {cause}", bytes.end - bytes.start);
                self.findings.add(bytes.start, "damaged record", what);
                self.mark_gap();
                self.head.add_damage(bytes.end - bytes.start);
            }
            FilePart::Truncated { byte } => {
                self.findings.add(byte, "end of the file", "the file is truncated here");
            }
            FilePart::AfterEnd { bytes } => {
                self.findings.add(bytes.start, "end of the file", after_end_text(&bytes));
            }
        }
        Ok(())
    }

    /// Ends the message indexes of a chunk at the next record of another kind.
    fn end_message_indexes(&mut self, byte: u64, opcode: u8) {
        if opcode != op::MESSAGE_INDEX && self.places.end_chunk() {
            let what = "a message index is missing after the chunk before";
            self.findings.add_index(byte, "chunk", what);
        }
    }

    /// Adds content that cannot be checked.
    fn not_checked(&mut self, what: String) {
        let all = &mut self.extent.not_checked;
        match all.len() {
            0..NOT_CHECKED_MAX => all.push(what),
            NOT_CHECKED_MAX => all.push("more content of other programs".to_owned()),
            _ => {}
        }
    }

    fn mark_gap(&mut self) {
        self.has_damage = true;
        self.places.end_chunk();
        if let Some(content) = &mut self.head.content {
            content.mark_gap();
        }
    }

    fn add_record(&mut self, byte: u64, opcode: u8, body: &[u8]) -> Result<(), ReadError> {
        let record = match mcap::parse_record(opcode, body) {
            Ok(record) => record,
            Err(error) => {
                self.findings.add(byte, record_name(opcode), error.to_string());
                self.mark_gap();
                self.head.add_damage(body.len() as u64);
                return Ok(());
            }
        };
        let size_bytes = (RECORD_HEADER_SIZE_BYTES + body.len()) as u64;
        if let Some(summary) = &mut self.summary {
            if let Err(what) = summary.check(byte, &record, size_bytes, &mut self.places)
                && !self.has_damage
            {
                self.findings.add_index(byte, record_name(opcode), what);
            }
        } else {
            self.add_data_record(byte, &record, size_bytes)?;
        }
        if opcode == op::DATA_END && self.summary.is_none() {
            self.summary = Some(SummaryCheck::new(byte + size_bytes));
        }
        Ok(())
    }

    /// Checks a record before the end of the data.
    fn add_data_record(
        &mut self,
        byte: u64,
        record: &Record<'_>,
        size_bytes: u64,
    ) -> Result<(), ReadError> {
        let result = match record {
            Record::Header(header) if !self.has_header => {
                self.has_header = true;
                self.head.library.clone_from(&header.library);
                Ok(())
            }
            Record::Attachment { header, data, crc } => {
                if *crc == 0 {
                    self.not_checked(no_checksum(&header.name));
                }
                if self.head.is_scene(&header.name) {
                    self.head.add_scene(data.len());
                }
                self.places.add_attachment(byte, size_bytes, header, data.len() as u64);
                Ok(())
            }
            Record::Metadata(metadata) => {
                self.places.add_metadata(byte, size_bytes, &metadata.name);
                self.head.add_metadata(metadata)?;
                Ok(())
            }
            // The chunk before it is damaged.
            Record::MessageIndex(_) if self.has_damage && !self.places.has_chunk() => Ok(()),
            Record::MessageIndex(index) => self.places.check_message_index(byte, size_bytes, index),
            Record::Message { header, data } => {
                self.add_message(InFile { byte, record: "message" }, header, data, 0);
                Ok(())
            }
            Record::Schema { header, .. } => {
                self.add_schema(header.id);
                Ok(())
            }
            Record::Channel(channel) => self.add_channel(channel),
            Record::DataEnd(_) => Ok(()),
            Record::Footer(_) => Err("the end of the data is missing before it".to_owned()),
            other if is_of_index(other.opcode()) => {
                Err("it stands before the end of the data".to_owned())
            }
            _ => Err("it does not belong here".to_owned()),
        };
        if let Err(what) = result {
            self.findings.add_index(byte, record_name(record.opcode()), what);
        }
        Ok(())
    }

    fn add_schema(&mut self, id: u16) {
        self.places.schemas.insert(id);
        let count = u16::try_from(self.places.schemas.len()).unwrap_or(u16::MAX);
        self.places.statistics.schema_count = count;
    }

    fn add_channel(&mut self, channel: &Channel) -> Result<(), String> {
        let content = self.head.content.as_mut().ok_or("it stands before the metadata 'run'")?;
        self.places.statistics.channel_count += u32::from(!content.is_declared(channel.id));
        content.add_channel(channel)
    }

    fn add_chunk(
        &mut self,
        byte: u64,
        size_bytes: usize,
        chunk: &Chunk<'_>,
        chunks: &mut ChunkContent,
    ) {
        self.extent.chunk_count += 1;
        if let Err(cause) = chunks.read(chunk) {
            self.findings.add(byte, "chunk", cause);
            self.places.statistics.chunk_count += 1;
            self.mark_gap();
            return;
        }
        let content = chunks.of(chunk.data);
        self.places.begin_chunk(byte, size_bytes as u64, &chunk.header);
        if chunk.header.uncompressed_crc == 0 && !content.is_empty() {
            self.findings.add_index(byte, "chunk", "it has no checksum");
        }
        self.add_content(byte, content);
    }

    fn add_content(&mut self, byte: u64, content: &[u8]) {
        for record in InnerRecords::from(content, 0) {
            let result = record.and_then(|inner| {
                match inner.parse()? {
                    Record::Schema { header, .. } => self.add_schema(header.id),
                    Record::Channel(channel) => self.add_channel(&channel)?,
                    Record::Message { header, data } => {
                        let place = InFile { byte, record: "chunk, message" };
                        self.add_message(place, &header, &data, inner.offset);
                    }
                    other => return Err(format!("a {} in it", record_name(other.opcode()))),
                }
                Ok(())
            });
            if let Err(what) = result {
                self.findings.add(byte, "chunk", what);
            }
        }
        if let Err(what) = self.places.check_times() {
            self.findings.add_index(byte, "chunk", what);
        }
    }

    fn add_message(&mut self, place: InFile, header: &MessageHeader, data: &[u8], offset: u64) {
        self.places.add_message(header, offset);
        self.extent.message_count += 1;
        let Some(content) = &mut self.head.content else { return };
        let result = content.check(header, data);
        if !content.is_declared(header.channel_id) && !self.undeclared.insert(header.channel_id) {
            return;
        }
        if let Err(what) = result {
            let topic = content.topic(header.channel_id);
            let on = topic.map_or_else(String::new, |topic| format!(" on {}", topic.name()));
            self.findings.add(place.byte, format!("{}{on}", place.record), what);
        }
        if self.first_step.is_none() {
            self.first_step = content.last_row().map(|row| row.step);
        }
    }

    /// Compares the checksum of a section, which a record ends.
    fn end_section(&mut self, byte: u64, opcode: u8, section: SectionChecksum) {
        let is_index = opcode == op::FOOTER;
        let name = if is_index { "index" } else { "data" };
        if section.saved == 0 {
            let what = format!("the {name} has no checksum");
            self.findings.add_index(byte, record_name(opcode), what);
        } else if section.is_wrong() && (is_index || !self.has_damage) {
            let what = format!(
                "the checksum of the {name} before it is {:08x}, but those bytes have {:08x}",
                section.saved, section.calculated
            );
            self.findings.add_index(byte, record_name(opcode), what);
        } else if is_index {
            self.check_index(byte);
        }
    }

    fn check_index(&mut self, byte: u64) {
        let Some(summary) = &self.summary else { return };
        if let Err(what) = summary.check_complete(&self.places)
            && !self.has_damage
        {
            self.findings.add_index(byte, "footer", what);
        }
    }

    fn finish(mut self, size_bytes: u64) -> Result<CheckReport, ReadError> {
        let Some(mut content) = self.head.content.take() else {
            return Err(self.head.no_run(&self.findings));
        };
        if let Some(step) = content.take_row() {
            let what = format!("step {step}: the row in /steps has no snapshot after it");
            self.findings.add(size_bytes, "end of the file", what);
        }
        self.check_declared(&content, size_bytes);
        let extent = &mut self.extent;
        extent.size_bytes = size_bytes;
        extent.snapshot_count = content.counts[Topic::Particles].written;
        let last = content.last_row().map(|row| row.step);
        extent.steps = self.first_step.zip(last).map(|(first, last)| [first, last]);
        extent.unhashed_count = content.unhashed_count;
        if extent.unhashed_count > 0 {
            extent.not_checked.push(format!(
                "the hash of {} snapshots, whose torn constraints are in missing messages",
                extent.unhashed_count
            ));
        }
        Ok(CheckReport { findings: self.findings, extent: self.extent })
    }

    /// Compares the messages that are missing with those that the file declares.
    fn check_declared(&mut self, content: &ContentCheck, end: u64) {
        let found = content.gaps.counts();
        let Some(closing) = &self.head.closing else {
            if self.findings.count() == 0 {
                self.findings.add_index(
                    end,
                    "end of the file",
                    "the metadata 'recorder' is missing",
                );
            }
            return;
        };
        self.extent.declared_missing =
            closing.missing().values().fold(0, |sum, count| sum.saturating_add(*count));
        if self.has_damage {
            return;
        }
        for topic in Topic::ALL {
            let (claimed, counted) = (closing.counts[topic], content.counts[topic]);
            let declared = claimed.lost.saturating_add(claimed.gaps);
            let name = topic.name();
            if found[topic].gaps > declared {
                let what = format!(
                    "{} messages on {name} are missing, but the file declares {declared}",
                    found[topic].gaps
                );
                self.findings.add_missing(end, "metadata 'recorder'", what);
            }
            if claimed.written != counted.written {
                let what = format!(
                    "it counts {} messages on {name}, but the file has {}",
                    claimed.written, counted.written
                );
                if claimed.written > counted.written {
                    self.findings.add_missing(end, "metadata 'recorder'", what);
                } else {
                    self.findings.add_index(end, "metadata 'recorder'", what);
                }
            }
        }
    }
}

/// Returns the description of an attachment that cannot be checked.
fn no_checksum(name: &str) -> String {
    format!("the attachment '{name}', which has no checksum")
}
