//! Reads a recording from its start, with every checksum verified, as far as the file goes.

use std::collections::BTreeMap;
use std::io::Read;

use mcap::records::{MessageHeader, Record, op};
use sim_messages::{ParticleState, StopFlag};

use super::decode::{LoggedMessage, MessageDecoder};
use super::records::RecordReader;
use crate::log::read_error::{LogEnd, ReadError};
use crate::log::run::selection::{ContentSelection, SELECTION_METADATA};
use crate::log::run::{
    CLOSING_METADATA, Closing, FORMAT_VERSION, FORMAT_VERSION_KEY, RUN_METADATA, RunDescription,
    SCENE_ATTACHMENT,
};
use crate::log::scanner::limits::SizeLimits;
use crate::log::scanner::window::Window;
use crate::log::source::FileSource;
use crate::log::topic::Topic;

/// Reads one recording from its start.
///
/// A truncated or damaged file is read as far as it goes, and [`LogReader::end`] reports it.
pub struct LogReader<R> {
    records: RecordReader<R>,
    limits: SizeLimits,
    channels: BTreeMap<u16, Option<Topic>>,
    run: RunDescription,
    scene: Vec<u8>,
    selection: ContentSelection,
    closing: Option<Closing>,
    transform_count: u64,
    /// Memory for particles.
    spare: Vec<Vec<ParticleState>>,
}

impl LogReader<FileSource> {
    /// Reads the header of a file that other readers may share. After a signal, this and every later read ends with
    /// [`ReadError::Interrupted`].
    ///
    /// # Errors
    /// If the file is not a recording or has no readable header, and after a signal.
    pub fn of_file(
        file: impl Into<FileSource>,
        stop: Option<&StopFlag>,
    ) -> Result<Self, ReadError> {
        Self::of_window(Window::growing(file.into(), stop.cloned()))
    }

    /// Continues at a chunk.
    pub(in crate::log) fn go_to(&mut self, chunk: &ChunkStart<'_>) {
        self.records.go_to(chunk.byte);
        self.channels.extend(chunk.channels);
        self.closing = None;
    }
}

/// A chunk to continue at.
#[derive(Debug)]
pub(in crate::log) struct ChunkStart<'a> {
    /// First byte of the chunk in the file.
    pub(in crate::log) byte: u64,
    /// The channels that chunks before it declare.
    pub(in crate::log) channels: &'a BTreeMap<u16, Option<Topic>>,
}

impl<R: Read> LogReader<R> {
    /// Reads the header of a recording.
    ///
    /// # Errors
    /// If the source is not a recording or has no readable header.
    pub fn new(source: R) -> Result<Self, ReadError> {
        Self::of_window(Window::in_order(source))
    }

    fn of_window(window: Window<R>) -> Result<Self, ReadError> {
        let mut records = RecordReader::new(window)?;
        let mut library = String::new();
        let mut scene = None;
        let mut selection = ContentSelection::default();
        loop {
            match records.next(read_header_record)? {
                Some(HeaderRecord::File(name)) => library = name,
                Some(HeaderRecord::Scene(bytes)) => scene = Some(bytes),
                Some(HeaderRecord::Run(map)) => {
                    if scene.is_none() && !map.contains_key(FORMAT_VERSION_KEY) {
                        return Err(ReadError::Foreign { library });
                    }
                    let (run, scene) = (read_run(&map)?, scene.unwrap_or_default());
                    let limits = SizeLimits::new(&run, scene.len());
                    records.set_limits(limits);
                    return Ok(Self {
                        records,
                        limits,
                        channels: BTreeMap::new(),
                        run,
                        scene,
                        selection,
                        closing: None,
                        transform_count: 0,
                        spare: Vec::new(),
                    });
                }
                Some(HeaderRecord::Selection(map)) => selection = ContentSelection::read(&map)?,
                Some(HeaderRecord::Skipped) => {}
                Some(HeaderRecord::Message) => return Err(ReadError::Foreign { library }),
                None => {
                    return Err(match records.end {
                        Some(LogEnd::Complete) | None => ReadError::Foreign { library },
                        Some(end) => ReadError::NoHeader(end),
                    });
                }
            }
        }
    }

    /// Decompresses chunks in Rust, as without the feature `zstd`.
    #[cfg(test)]
    pub(crate) fn decompress_in_rust(&mut self) {
        self.records.content.decompress = crate::log::compression::rust_decompressor();
    }

    pub(in crate::log) fn limits(&self) -> SizeLimits {
        self.limits
    }

    /// Returns the number of bytes of the file that are read and intact.
    pub fn intact_count(&self) -> u64 {
        self.records.intact_count()
    }

    /// Returns the run that was recorded.
    pub fn run(&self) -> &RunDescription {
        &self.run
    }

    /// Returns the part of the run that the recording holds.
    pub fn selection(&self) -> ContentSelection {
        self.selection
    }

    /// Returns the text of the complete effective scene. It is empty if the file has none.
    pub fn scene(&self) -> &[u8] {
        &self.scene
    }

    /// Returns the number of messages on `/tf` so far, which [`LogReader::next_message`] skips.
    pub fn transform_count(&self) -> u64 {
        self.transform_count
    }

    /// Returns the closing metadata, once the last message has been read.
    pub fn closing(&self) -> Option<&Closing> {
        self.closing.as_ref()
    }

    /// Returns the end of the file, once [`LogReader::next_message`] has returned `None`.
    pub fn end(&self) -> Option<&LogEnd> {
        self.records.end.as_ref()
    }

    /// Takes the memory of particles that are no longer needed, for those of later messages.
    pub(in crate::log) fn add_spare(&mut self, particles: Vec<ParticleState>) {
        self.spare.push(particles);
    }

    /// Returns the next message, or `None` at the end of the readable part. Skips `/tf` and foreign
    /// topics.
    ///
    /// # Errors
    /// If the operating system reports an error or the content of a message is invalid.
    pub fn next_message(&mut self) -> Result<Option<LoggedMessage>, ReadError> {
        let Self { records, limits, channels, run, closing, transform_count, spare, .. } = self;
        let decoder = MessageDecoder { run, limits, spare };
        let mut content = Content { decoder, channels, closing, transform_count };
        loop {
            match records.next(|record, byte| content.read(record, byte))? {
                Some(Some(logged)) => return Ok(Some(logged)),
                Some(None) => {}
                None => return Ok(None),
            }
        }
    }
}

/// The records after the header, and the parts of a reader that they change.
struct Content<'a> {
    decoder: MessageDecoder<'a>,
    channels: &'a mut BTreeMap<u16, Option<Topic>>,
    closing: &'a mut Option<Closing>,
    transform_count: &'a mut u64,
}

impl Content<'_> {
    fn read(&mut self, record: Record<'_>, byte: u64) -> Result<Option<LoggedMessage>, ReadError> {
        match record {
            Record::Channel(channel) => {
                self.channels.insert(channel.id, Topic::from_name(&channel.topic));
            }
            Record::Metadata(metadata) if metadata.name == CLOSING_METADATA => {
                *self.closing = Some(Closing::from_map(&metadata.metadata));
            }
            Record::Message { header, data } => return self.read_message(&header, &data, byte),
            _ => {}
        }
        Ok(None)
    }

    fn read_message(
        &mut self,
        header: &MessageHeader,
        data: &[u8],
        byte: u64,
    ) -> Result<Option<LoggedMessage>, ReadError> {
        let Some(topic) = self.channels.get(&header.channel_id).copied().flatten() else {
            return Ok(None);
        };
        let sequence = header.sequence;
        let malformed = |what| ReadError::Malformed { topic: topic.name(), sequence, byte, what };
        let logged = self.decoder.decode(topic, header, data).map_err(malformed)?;
        *self.transform_count += u64::from(logged.is_none());
        Ok(logged)
    }
}

impl<R> std::fmt::Debug for LogReader<R> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("LogReader").field("run", &self.run).finish_non_exhaustive()
    }
}

/// A record before the first message, reduced to what the reader uses.
enum HeaderRecord {
    /// The library that wrote the file.
    File(String),
    Scene(Vec<u8>),
    Run(BTreeMap<String, String>),
    Selection(BTreeMap<String, String>),
    Message,
    Skipped,
}

#[allow(clippy::unnecessary_wraps, reason = "the signature that RecordReader requires")]
fn read_header_record(record: Record<'_>, _byte: u64) -> Result<HeaderRecord, ReadError> {
    Ok(match record {
        Record::Header(header) => HeaderRecord::File(header.library),
        Record::Attachment { header, data, .. } if header.name == SCENE_ATTACHMENT => {
            HeaderRecord::Scene(data.into_owned())
        }
        Record::Metadata(metadata) if metadata.name == RUN_METADATA => {
            HeaderRecord::Run(metadata.metadata)
        }
        Record::Metadata(metadata) if metadata.name == SELECTION_METADATA => {
            HeaderRecord::Selection(metadata.metadata)
        }
        Record::Message { .. } | Record::Unknown { opcode: op::CHUNK, .. } => HeaderRecord::Message,
        _ => HeaderRecord::Skipped,
    })
}

/// Reads the metadata `run`.
pub(in crate::log) fn read_run(
    map: &BTreeMap<String, String>,
) -> Result<RunDescription, ReadError> {
    match map.get(FORMAT_VERSION_KEY) {
        Some(text) if *text == FORMAT_VERSION.to_string() => {}
        Some(text) => return Err(ReadError::Version { found: text.clone() }),
        None => return Err(ReadError::BadRun { key: FORMAT_VERSION_KEY.to_owned() }),
    }
    RunDescription::from_map(map).map_err(|key| ReadError::BadRun { key })
}
