//! Writes a recording: append-only, in complete chunks, and nothing after the first error.

#[cfg(feature = "files")]
mod run_id;
mod sink;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Read, Write};

use mcap::records::{AttachmentHeader, MessageHeader, Metadata};
use mcap::{Attachment, WriteOptions, Writer};
#[cfg(feature = "files")]
use sim_host::explain_write_error;

use super::compression::Compression;
use super::encoding::{MessageEncoder, ParticleBuffer, TopicFormat, encode_transform};
use super::message::Message;
use super::rows::ColliderDetails;
use super::rows::{MeshFile, SceneColliders};
use super::run::selection::{ContentSelection, SELECTION_METADATA};
use super::run::{
    CLOSING_METADATA, Closing, RUN_METADATA, RunDescription, SCENE_ATTACHMENT, SCENE_MEDIA_TYPE,
    header_library,
};
use super::topic::{AllCounts, Topic};
#[cfg(feature = "files")]
pub(crate) use run_id::replace_run_id;
use sink::{ChunkSink, SinkHandle};

/// Bytes of an attachment to copy at a time.
const COPY_SIZE_BYTES: usize = 1 << 18;

/// Options of a [`LogWriter`].
#[derive(Debug, Clone, Copy)]
pub struct LogOptions {
    /// Default: zstd. None without the feature `zstd`.
    pub compression: Compression,
    /// Uncompressed size at which a chunk is closed, in bytes. A killed process loses its open
    /// chunk. Default: 1 MiB.
    pub chunk_size_bytes: u64,
    /// Declaration of the content that the caller leaves out. Default: none.
    pub selection: ContentSelection,
}

impl Default for LogOptions {
    fn default() -> Self {
        Self {
            compression: Compression::default(),
            chunk_size_bytes: 1 << 20,
            selection: ContentSelection::default(),
        }
    }
}

/// The reason why a recording could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The first error. The file ends before it.
    #[error("cannot write: {0}")]
    Failed(String),
    /// A call after the first error.
    #[error("the recording ended with an earlier error")]
    Stopped,
}

impl From<mcap::McapError> for WriteError {
    fn from(error: mcap::McapError) -> Self {
        match error {
            mcap::McapError::Io(cause) => cause.into(),
            other => Self::Failed(other.to_string()),
        }
    }
}

impl From<io::Error> for WriteError {
    fn from(error: io::Error) -> Self {
        #[cfg(not(feature = "files"))]
        let explain_write_error = io::Error::to_string;
        Self::Failed(explain_write_error(&error))
    }
}

impl From<serde_json::Error> for WriteError {
    fn from(error: serde_json::Error) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Writes one recording.
///
/// The first error is final: the file stays readable up to it, while a file that continued after
/// an error would claim to be complete. A writer that is dropped without [`LogWriter::finish`]
/// leaves a file without an end, as a killed process does.
pub struct LogWriter<W: Write> {
    /// `None` after an error.
    file: Option<Writer<ChunkSink<W>>>,
    sink: SinkHandle,
    run: RunDescription,
    /// Channel of each declared topic, in the order of [`Topic::ALL`].
    channels: Channels,
    encoder: MessageEncoder,
    selection: ContentSelection,
    /// By collider. Empty until they are known.
    collider_details: Vec<ColliderDetails>,
    /// Newest time of reception. Log times never decrease.
    log_time_ns: u64,
    /// The log time of the newest snapshot.
    snapshot_log_time_ns: Option<u64>,
    /// Only `written` is set.
    counts: AllCounts,
}

impl<W: Write> LogWriter<W> {
    /// Starts a recording with its header: the scene, the run, the schemas and `/tf`.
    /// `log_time_ns` is the current wall clock, in nanoseconds since 1970.
    ///
    /// # Errors
    /// If the header cannot be written.
    pub fn create(
        out: W,
        options: LogOptions,
        run: &RunDescription,
        scene: &[u8],
        log_time_ns: u64,
    ) -> Result<Self, WriteError> {
        let out = ChunkSink::new(out);
        let sink = out.handle();
        let mut file = write_options(options).create(out)?;
        let selected = write_selection(&mut file, options.selection);
        match selected
            .and_then(|()| write_header(&mut file, options.selection, run, scene, log_time_ns))
        {
            Ok(channels) => {
                let mut counts = AllCounts::default();
                counts[Topic::Tf].written = 1;
                Ok(Self {
                    file: Some(file),
                    sink,
                    run: run.clone(),
                    channels,
                    encoder: MessageEncoder::default(),
                    selection: options.selection,
                    collider_details: Vec::new(),
                    log_time_ns,
                    snapshot_log_time_ns: None,
                    counts,
                })
            }
            Err(error) => {
                drop(file.into_inner());
                Err(error)
            }
        }
    }

    /// Appends a message. `log_time_ns` is the wall clock of its reception. A time earlier than
    /// that of the previous message is replaced by it. Snapshots received at once get times of 1 ns
    /// apart, because viewers show one snapshot at a time.
    ///
    /// # Errors
    /// If this or an earlier call failed, or for forces in a recording whose selection lacks them.
    pub fn write(&mut self, message: &Message, log_time_ns: u64) -> Result<(), WriteError> {
        let header = self.message_header(message.topic(), message.step(), log_time_ns)?;
        let detailed = self.with_details(message);
        let message = detailed.as_ref().unwrap_or(message);
        let data = self.encoder.encode(message, header.publish_time)?;
        let file = self.file.as_mut().ok_or(WriteError::Stopped)?;
        let result = file.write_to_known_channel(&header, data);
        self.count_written(message.topic(), result)
    }

    /// Appends the particles of a snapshot, like [`LogWriter::write`], but copies them at most once.
    /// [`LogWriter::take_spare`] returns the buffer when it is written.
    ///
    /// # Errors
    /// If this or an earlier call failed.
    pub fn write_particles(
        &mut self,
        step: u64,
        mut particles: ParticleBuffer,
        log_time_ns: u64,
    ) -> Result<(), WriteError> {
        let header = self.message_header(Topic::Particles, step, log_time_ns)?;
        let file = self.file.as_mut().ok_or(WriteError::Stopped)?;
        particles.encode_head(header.publish_time);
        let result = self
            .sink
            .write_message(particles, |message| file.write_to_known_channel(&header, message));
        self.count_written(Topic::Particles, result)
    }

    /// Returns a buffer that is written, for the next particles.
    pub fn take_spare(&mut self) -> Option<ParticleBuffer> {
        self.sink.take_spare()
    }

    /// Returns the row of colliders with their details, if they are known.
    fn with_details(&self, message: &Message) -> Option<Message> {
        let Message::Colliders(row) = message else { return None };
        let details = self.collider_details.as_slice();
        (!details.is_empty()).then(|| Message::Colliders(row.clone().with_details(details)))
    }

    fn message_header(
        &mut self,
        topic: Topic,
        step: u64,
        log_time_ns: u64,
    ) -> Result<MessageHeader, WriteError> {
        let channel_id = self.channels[topic.index()].ok_or_else(|| {
            let name = topic.name();
            WriteError::Failed(format!("the selection of the recording lacks {name}"))
        })?;
        self.log_time_ns = self.log_time_ns.max(log_time_ns);
        if topic == Topic::Particles {
            let after = self.snapshot_log_time_ns.map_or(0, |time_ns| time_ns.saturating_add(1));
            self.log_time_ns = self.log_time_ns.max(after);
            self.snapshot_log_time_ns = Some(self.log_time_ns);
        }
        Ok(MessageHeader {
            channel_id,
            sequence: low_32_bits(step),
            log_time: self.log_time_ns,
            publish_time: self.run.time_of_step_ns(step),
        })
    }

    fn count_written(
        &mut self,
        topic: Topic,
        result: mcap::McapResult<()>,
    ) -> Result<(), WriteError> {
        self.stop_on_error(result)?;
        self.counts[topic].written += 1;
        Ok(())
    }

    /// Returns the declaration of the content that the caller leaves out, and of what it records on request.
    pub fn selection(&self) -> &ContentSelection {
        &self.selection
    }

    /// Returns the number of messages written so far, by topic. The other counts are 0.
    pub fn counts(&self) -> &AllCounts {
        &self.counts
    }

    /// Writes a metadata record. Readers of recordings skip it.
    ///
    /// # Errors
    /// If this or an earlier call failed.
    pub fn write_metadata(
        &mut self,
        name: &str,
        entries: BTreeMap<String, String>,
    ) -> Result<(), WriteError> {
        let metadata = Metadata { name: name.to_owned(), metadata: entries };
        let result = self.file.as_mut().ok_or(WriteError::Stopped)?.write_metadata(&metadata);
        self.stop_on_error(result)
    }

    /// Attaches the meshes of the scene as files, and adds the details of the colliders to their rows from now on.
    ///
    /// # Errors
    /// If this or an earlier call failed.
    pub fn describe_colliders(&mut self, colliders: &SceneColliders) -> Result<(), WriteError> {
        self.collider_details.clone_from(&colliders.details);
        colliders.files.iter().try_for_each(|MeshFile { name, text }| {
            self.attach(name, text.len() as u64, text.as_bytes())
        })
    }

    /// Copies an attachment of `size_bytes` into the file. Readers of recordings skip it.
    ///
    /// # Errors
    /// If this or an earlier call failed, or `content` ends early.
    pub fn attach(
        &mut self,
        name: &str,
        size_bytes: u64,
        content: impl Read,
    ) -> Result<(), WriteError> {
        let header = AttachmentHeader {
            log_time: self.log_time_ns,
            create_time: 0,
            name: name.to_owned(),
            media_type: "application/octet-stream".to_owned(),
        };
        // The open chunk is passed on whole.
        self.flush()?;
        let file = self.file.as_mut().ok_or(WriteError::Stopped)?;
        self.sink.begin_attachment();
        let copied = copy_attachment(file, size_bytes, header, content);
        self.sink.end_attachment();
        match copied {
            Ok(()) => Ok(()),
            Err(error) => {
                self.abandon();
                Err(error)
            }
        }
    }

    /// Returns the size of the file so far, in bytes, with what compression has returned of the open chunk.
    pub fn size_bytes(&self) -> u64 {
        self.sink.size_bytes()
    }

    /// Closes the open chunk and writes everything to the operating system, so that it outlives
    /// this process.
    ///
    /// # Errors
    /// If this or an earlier call failed.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        let result = self.file.as_mut().ok_or(WriteError::Stopped)?.flush();
        self.stop_on_error(result)
    }

    /// Writes the closing metadata and the index, and returns the sink.
    ///
    /// # Errors
    /// If this or an earlier call failed. The file then has no end.
    pub fn finish(mut self, closing: &Closing) -> Result<W, WriteError> {
        let file = self.file.as_mut().ok_or(WriteError::Stopped)?;
        let metadata = Metadata { name: CLOSING_METADATA.to_owned(), metadata: closing.to_map() };
        let result = file.write_metadata(&metadata).and_then(|()| file.finish().map(drop));
        self.stop_on_error(result)?;
        let file = self.file.take().ok_or(WriteError::Stopped)?;
        let mut out = file.into_inner().into_inner();
        out.flush()?;
        Ok(out)
    }

    fn stop_on_error(&mut self, result: mcap::McapResult<()>) -> Result<(), WriteError> {
        if result.is_err() {
            self.abandon();
        }
        Ok(result?)
    }

    /// Releases the file as it is. Dropping the writer of mcap would finish the file instead.
    fn abandon(&mut self) {
        drop(self.file.take().map(Writer::into_inner));
    }
}

impl<W: Write> Drop for LogWriter<W> {
    fn drop(&mut self) {
        self.abandon();
    }
}

impl<W: Write> std::fmt::Debug for LogWriter<W> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("LogWriter").field("run", &self.run).finish_non_exhaustive()
    }
}

fn write_options(options: LogOptions) -> WriteOptions {
    let written = WriteOptions::new()
        .profile("")
        .library(header_library(env!("CARGO_PKG_VERSION")) + mcap::LIBRARY_IDENTIFIER)
        .chunk_size(Some(options.chunk_size_bytes));
    options.compression.add_to(written)
}

/// Declares the selection. Nothing declares the default.
fn write_selection<W: Write>(
    file: &mut Writer<ChunkSink<W>>,
    selection: ContentSelection,
) -> Result<(), WriteError> {
    if selection == ContentSelection::default() {
        return Ok(());
    }
    let name = SELECTION_METADATA.to_owned();
    Ok(file.write_metadata(&Metadata { name, metadata: selection.to_map() })?)
}

/// The channel of each topic that a file declares, in the order of [`Topic::ALL`].
type Channels = [Option<u16>; Topic::ALL.len()];

fn write_header<W: Write>(
    file: &mut Writer<ChunkSink<W>>,
    selection: ContentSelection,
    run: &RunDescription,
    scene: &[u8],
    log_time_ns: u64,
) -> Result<Channels, WriteError> {
    file.attach(&Attachment {
        log_time: log_time_ns,
        create_time: run.epoch_ns,
        name: SCENE_ATTACHMENT.to_owned(),
        media_type: SCENE_MEDIA_TYPE.to_owned(),
        data: Cow::Borrowed(scene),
    })?;
    file.write_metadata(&Metadata { name: RUN_METADATA.to_owned(), metadata: run.to_map() })?;
    let mut channels = [None; Topic::ALL.len()];
    for topic in Topic::ALL.into_iter().filter(|topic| selection.has_topic(*topic)) {
        channels[topic.index()] = Some(add_channel(file, topic)?);
    }
    let publish_time = run.time_of_step_ns(0);
    if let Some(channel_id) = channels[Topic::Tf.index()] {
        let header = MessageHeader { channel_id, sequence: 0, log_time: log_time_ns, publish_time };
        file.write_to_known_channel(&header, &encode_transform(publish_time, run.origin, run.up))?;
    }
    Ok(channels)
}

fn copy_attachment<W: Write>(
    file: &mut Writer<ChunkSink<W>>,
    size_bytes: u64,
    header: AttachmentHeader,
    mut content: impl Read,
) -> Result<(), WriteError> {
    file.start_attachment(size_bytes, header)?;
    let mut buffer = vec![0; COPY_SIZE_BYTES];
    let mut left = size_bytes;
    while left > 0 {
        let wanted = usize::try_from(left).unwrap_or(usize::MAX).min(buffer.len());
        let count = content.read(&mut buffer[..wanted])?;
        if count == 0 {
            return Err(WriteError::Failed(format!(
                "it has become shorter by {left} bytes since the start"
            )));
        }
        file.put_attachment_bytes(&buffer[..count])?;
        left -= count as u64;
    }
    Ok(file.finish_attachment()?)
}

fn add_channel<W: Write>(file: &mut Writer<ChunkSink<W>>, topic: Topic) -> mcap::McapResult<u16> {
    let TopicFormat { encoding, schema } = TopicFormat::for_topic(topic);
    let schema_id = file.add_schema(schema.name, schema.encoding, &schema.data)?;
    file.add_channel(schema_id, topic.name(), encoding, &BTreeMap::new())
}

#[allow(clippy::cast_possible_truncation, reason = "the low half is wanted")]
fn low_32_bits(step: u64) -> u32 {
    step as u32
}
