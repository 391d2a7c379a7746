//! The output of a repair: sound messages with a new index, and the declaration of the others.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

use mcap::records::{AttachmentHeader, Channel, MessageHeader, Metadata, Record, SchemaHeader};
use mcap::write::NoSeek;
use mcap::{Attachment, WriteOptions, Writer};

use super::content::{ContentCheck, Validity};
use super::losses::Losses;
use super::lost_load::LoadRows;
use crate::log::compression::Compression;
use crate::log::encoding::{MessageEncoder, TopicFormat, encode_transform};
use crate::log::run::{CLOSING_METADATA, Closing, REPAIR_METADATA};
use crate::log::topic::Topic;
use crate::log::writer::WriteError;

/// Uncompressed size at which a chunk is closed, as in a recording.
const CHUNK_SIZE_BYTES: u64 = 1 << 20;
/// Most bytes of all schemas and channels. Those of a recorder have 20 kilobytes.
const DECLARED_SIZE_BYTES_MAX: usize = 16 << 20;
/// Memory of a record or of a text besides its bytes.
const ENTRY_SIZE_BYTES: u64 = 128;
/// Reason in the closing metadata of a file that had none.
const UNKNOWN_STOP: &str = "unknown: the recording had no end, and was repaired";

/// A message with its header in the file.
#[derive(Debug)]
struct HeldRow {
    header: MessageHeader,
    data: Vec<u8>,
    step: u64,
}

/// The id of a schema or channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Declared {
    Schema(u16),
    Channel(u16),
}

/// The start of a recording that is lost.
#[derive(Debug)]
struct LostStart {
    /// The channels, by topic.
    ids: BTreeMap<&'static str, u16>,
    /// The load, as far as it is known.
    load: Option<LoadRows>,
}

/// The options of the output, from the input.
#[derive(Debug, Clone, Default)]
pub(super) struct Format {
    pub(super) library: String,
    /// "", "lz4" or "zstd". `None` if no chunk before the first intact part tells it.
    pub(super) compression: Option<String>,
}

/// The output of a repair.
pub(super) struct RepairWriter<W: Write> {
    /// `None` after an error. Dropping the writer of mcap would finish the file.
    file: Option<Writer<NoSeek<W>>>,
    /// The header of a snapshot, until its payload has followed.
    row: Option<HeldRow>,
    /// The step of the last header that was left out, because its payload is missing.
    dropped_row: Option<u64>,
    /// The lost start of the recording, until the first message.
    lost_start: Option<LostStart>,
    /// The ids of the schemas and channels so far.
    declared: BTreeSet<Declared>,
    /// Memory of the schemas and channels, which stay in memory for the index.
    declared_size_bytes: usize,
    pub(super) losses: Losses,
}

impl<W: Write> RepairWriter<W> {
    pub(super) fn create(out: W, format: &Format) -> Result<Self, WriteError> {
        let options = WriteOptions::new()
            .profile("")
            .library(format.library.as_str())
            .disable_seeking(true)
            .chunk_size(Some(CHUNK_SIZE_BYTES));
        let compression = Compression::as_in_chunks(format.compression.as_deref());
        let file = compression.add_to(options).create(NoSeek::new(out))?;
        Ok(Self {
            file: Some(file),
            row: None,
            dropped_row: None,
            lost_start: None,
            declared: BTreeSet::new(),
            declared_size_bytes: 0,
            losses: Losses::default(),
        })
    }

    /// Calls `write` with the file. The first error is final.
    fn write(
        &mut self,
        write: impl FnOnce(&mut Writer<NoSeek<W>>) -> mcap::McapResult<()>,
    ) -> Result<(), WriteError> {
        let file = self.file.as_mut().ok_or(WriteError::Stopped)?;
        let result = write(file);
        if result.is_err() {
            self.abandon();
        }
        Ok(result?)
    }

    fn abandon(&mut self) {
        drop(self.file.take().map(Writer::into_inner));
    }

    pub(super) fn attach(&mut self, attachment: &Attachment<'_>) -> Result<(), WriteError> {
        self.write(|file| file.attach(attachment))
    }

    /// Begins an attachment, whose data follow in pieces.
    pub(super) fn start_attachment(
        &mut self,
        size_bytes: u64,
        header: AttachmentHeader,
    ) -> Result<(), WriteError> {
        self.write(|file| file.start_attachment(size_bytes, header))
    }

    pub(super) fn put_attachment_bytes(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.write(|file| file.put_attachment_bytes(bytes))
    }

    pub(super) fn finish_attachment(&mut self) -> Result<(), WriteError> {
        self.write(Writer::finish_attachment)
    }

    pub(super) fn write_metadata(&mut self, metadata: &Metadata) -> Result<(), WriteError> {
        self.write(|file| file.write_metadata(metadata))
    }

    /// Counts the memory of a schema or channel. Other programs repeat them in each chunk.
    fn reserve(&mut self, id: Declared, size_bytes: usize) -> Result<(), String> {
        if self.declared.contains(&id) {
            return Ok(());
        }
        let sum = self.declared_size_bytes.saturating_add(size_bytes);
        if sum > DECLARED_SIZE_BYTES_MAX {
            return Err(format!(
                "the schemas and channels have more than {DECLARED_SIZE_BYTES_MAX} bytes"
            ));
        }
        self.declared_size_bytes = sum;
        self.declared.insert(id);
        Ok(())
    }

    /// Copies a schema. The inner `Err` is a conflict with an earlier one.
    pub(super) fn add_schema(
        &mut self,
        header: &SchemaHeader,
        data: &[u8],
    ) -> Result<Result<(), String>, WriteError> {
        let id = Declared::Schema(header.id);
        if let Err(what) = self.reserve(id, header.name.len() + header.encoding.len() + data.len())
        {
            return Ok(Err(what));
        }
        let mut conflict = Ok(());
        self.write(|file| {
            match file.add_schema_with_id(header.id, &header.name, &header.encoding, data) {
                Err(
                    error @ (mcap::McapError::ConflictingSchemas(_)
                    | mcap::McapError::InvalidSchemaId),
                ) => {
                    conflict = Err(error.to_string());
                    Ok(())
                }
                result => result.map(drop),
            }
        })?;
        Ok(conflict)
    }

    /// Copies a channel. The inner `Err` is a conflict with an earlier one, or a missing schema.
    pub(super) fn add_channel(
        &mut self,
        channel: &Channel,
    ) -> Result<Result<(), String>, WriteError> {
        let Channel { id, schema_id, topic, message_encoding, metadata } = channel;
        let texts = metadata.iter().map(|(key, value)| key.len() + value.len());
        let declared = Declared::Channel(*id);
        if let Err(what) =
            self.reserve(declared, topic.len() + message_encoding.len() + texts.sum::<usize>())
        {
            return Ok(Err(what));
        }
        let mut conflict = Ok(());
        self.write(|file| {
            match file.add_channel_with_id(*id, *schema_id, topic, message_encoding, metadata) {
                Err(
                    error @ (mcap::McapError::ConflictingChannels(_)
                    | mcap::McapError::UnknownSchema(..)),
                ) => {
                    conflict = Err(error.to_string());
                    Ok(())
                }
                result => result.map(drop),
            }
        })?;
        Ok(conflict)
    }

    /// Declares the channels as a recorder does, for a file that has lost its first chunk.
    pub(super) fn declare_channels(
        &mut self,
        content: &mut ContentCheck,
        load: Option<LoadRows>,
    ) -> Result<(), WriteError> {
        let mut ids = BTreeMap::new();
        let selection = content.selection();
        for topic in Topic::ALL.into_iter().filter(|topic| selection.has_topic(*topic)) {
            let TopicFormat { encoding, schema } = TopicFormat::for_topic(topic);
            let mut channel = Channel {
                id: 0,
                schema_id: 0,
                topic: topic.name().to_owned(),
                message_encoding: encoding.to_owned(),
                metadata: BTreeMap::new(),
            };
            self.write(|file| {
                let schema_id = file.add_schema(schema.name, schema.encoding, &schema.data)?;
                channel.id =
                    file.add_channel(schema_id, topic.name(), encoding, &channel.metadata)?;
                Ok(())
            })?;
            // A conflict is found with the first message of the channel.
            let _ = content.add_channel(&channel);
            ids.insert(topic.name(), channel.id);
        }
        content.load.is_start_lost = true;
        self.lost_start = Some(LostStart { ids, load });
        Ok(())
    }

    /// Writes `/tf` and the load before the first message, if the file has lost them. `header` and `topic` are
    /// those of this message.
    fn add_start(
        &mut self,
        header: &MessageHeader,
        topic: Option<Topic>,
        content: &mut ContentCheck,
    ) -> Result<(), WriteError> {
        let Some(LostStart { ids, load }) = self.lost_start.take() else { return Ok(()) };
        if topic != Some(Topic::Tf) {
            self.write_transform(ids[Topic::Tf.name()], header.log_time, content)?;
        }
        let Some(load) = load else { return Ok(()) };
        content.add_load(&load);
        let mut encoder = MessageEncoder::default();
        for message in load.messages() {
            let (step, topic) = (message.step(), message.topic());
            let publish_time = content.run().time_of_step_ns(step);
            #[allow(clippy::cast_possible_truncation, reason = "as in a recording")]
            let sequence = step as u32;
            let (channel_id, log_time) = (ids[topic.name()], header.log_time);
            let header = MessageHeader { channel_id, sequence, log_time, publish_time };
            let data = encoder.encode(&message, publish_time);
            let data = data.map_err(|error| WriteError::Failed(error.to_string()))?;
            self.write(|file| file.write_to_known_channel(&header, data))?;
            self.losses.restore(topic);
        }
        Ok(())
    }

    fn write_transform(
        &mut self,
        channel_id: u16,
        log_time: u64,
        content: &mut ContentCheck,
    ) -> Result<(), WriteError> {
        let run = content.run();
        let publish_time = run.time_of_step_ns(0);
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time };
        let data = encode_transform(publish_time, run.origin, run.up);
        content.counts[Topic::Tf].written += 1;
        self.write(|file| file.write_to_known_channel(&header, &data))
    }

    /// Checks a message, and copies it if it is sound. Returns the fault of another one.
    pub(super) fn add_message(
        &mut self,
        header: &MessageHeader,
        data: &[u8],
        content: &mut ContentCheck,
    ) -> Result<Result<(), String>, WriteError> {
        let topic = content.topic(header.channel_id);
        self.add_start(header, topic, content)?;
        if topic == Some(Topic::Steps) && self.row.is_some() {
            // The payload of the header before it is missing.
            self.losses.add_message(Some(Topic::Particles));
            self.dropped_row = content.row_step();
            self.drop_row(content);
        }
        match content.check(header, data) {
            Ok(Validity::Row) => {
                let step = content.row_step().unwrap_or(0);
                self.row = Some(HeldRow { header: *header, data: data.to_vec(), step });
            }
            Ok(Validity::Payload) => {
                let row = self.row.take().map(|row| (row.header, row.data, row.step));
                if let Some((row_header, row_data, step)) = row {
                    self.losses.end_gap(step);
                    self.write(|file| file.write_to_known_channel(&row_header, &row_data))?;
                }
                self.write(|file| file.write_to_known_channel(header, data))?;
            }
            Ok(Validity::Other | Validity::Update(_)) => {
                // A header without a payload ends a gap, too.
                if let (Some(Topic::Steps), Some(row)) = (topic, content.last_row()) {
                    self.losses.end_gap(row.step);
                }
                self.write(|file| file.write_to_known_channel(header, data))?;
            }
            Err(what) => {
                self.losses.add_message(topic);
                // A snapshot needs both messages.
                self.drop_row(content);
                return Ok(Err(what));
            }
        }
        Ok(Ok(()))
    }

    /// Returns the step of a header that the last message has shown to be without its payload, once.
    pub(super) fn take_dropped_row(&mut self) -> Option<u64> {
        self.dropped_row.take()
    }

    /// Marks a part of the file as lost.
    pub(super) fn mark_gap(&mut self, content: &mut ContentCheck) {
        self.drop_row(content);
        content.mark_gap();
        self.losses.add_part();
    }

    /// Leaves out a header without its payload.
    fn drop_row(&mut self, content: &mut ContentCheck) {
        if self.row.take().is_some() {
            content.uncount_row();
            self.losses.add_message(Some(Topic::Steps));
        }
    }

    /// Writes the end of the file: the closing metadata with all losses, and the index.
    pub(super) fn finish(
        mut self,
        closing: Option<Closing>,
        content: &mut ContentCheck,
        repair: &mut BTreeMap<String, String>,
    ) -> Result<(W, Losses), WriteError> {
        self.drop_row(content);
        self.losses.finish();
        let closing = self.losses.declare(closing, UNKNOWN_STOP, content);
        self.losses.add_to(repair);
        let metadata = Metadata { name: CLOSING_METADATA.to_owned(), metadata: closing.to_map() };
        self.write_metadata(&metadata)?;
        let name = REPAIR_METADATA.to_owned();
        self.write_metadata(&Metadata { name, metadata: repair.clone() })?;
        self.write(|file| file.finish().map(drop))?;
        let file = self.file.take().ok_or(WriteError::Stopped)?;
        let mut out = file.into_inner().into_inner();
        out.flush()?;
        Ok((out, std::mem::take(&mut self.losses)))
    }
}

impl<W: Write> Drop for RepairWriter<W> {
    fn drop(&mut self) {
        self.abandon();
    }
}

/// Returns the memory that an attachment or a metadata record takes.
pub(super) fn size_in_memory(record: &Record<'_>) -> u64 {
    let text = |text: &str| text.len() as u64 + ENTRY_SIZE_BYTES;
    match record {
        Record::Attachment { header, data, .. } => {
            text(&header.name) + text(&header.media_type) + data.len() as u64
        }
        Record::Metadata(Metadata { name, metadata }) => {
            let entries = metadata.iter().map(|(key, value)| text(key) + text(value));
            text(name) + entries.sum::<u64>()
        }
        _ => ENTRY_SIZE_BYTES,
    }
}
