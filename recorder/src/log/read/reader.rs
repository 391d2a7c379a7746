//! Reads a recording from its start, with every checksum verified, as far as the file goes.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::Path;

use mcap::records::{Record, op};
use sim_contract::Stop;

use super::decode::{LoggedMessage, decode_message};
use super::file_source::FileSource;
use super::limits::SizeLimits;
use super::open::open_regular_file;
use super::read_error::{LogEnd, ReadError};
use super::records::RecordReader;
use crate::log::part_file::part_path;
use crate::log::run::{
    CLOSING_METADATA, Closing, FORMAT_VERSION, FORMAT_VERSION_MIN, RUN_METADATA, RunDescription,
    SCENE_ATTACHMENT,
};
use crate::log::topic::Topic;

/// The entry of the metadata `run` that distinguishes our recordings from other MCAP files.
const FORMAT_VERSION_KEY: &str = "format_version";

/// Reads one recording from its start.
///
/// A truncated or damaged file is read as far as it goes, and [`LogReader::end`] reports it.
pub struct LogReader<R> {
    records: RecordReader<R>,
    limits: SizeLimits,
    channels: BTreeMap<u16, Option<Topic>>,
    run: RunDescription,
    scene: Vec<u8>,
    closing: Option<Closing>,
}

impl LogReader<FileSource> {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// If the file is not a recording or has no readable header.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::open_file(path, None)
    }

    /// Opens a file and reads its header. After a signal, this and every later read ends with
    /// [`ReadError::Interrupted`].
    ///
    /// # Errors
    /// Like [`LogReader::open`], and after a signal.
    pub fn open_until(path: &Path, stop: &Stop) -> Result<Self, ReadError> {
        Self::open_file(path, Some(stop.clone()))
    }

    pub(in crate::log) fn open_file(path: &Path, stop: Option<Stop>) -> Result<Self, ReadError> {
        let file = open_regular_file(path).map_err(|cause| open_error(path, cause))?;
        Self::new(FileSource::new(file, stop))
    }
}

/// Names the unfinished part of a recording that does not exist yet.
fn open_error(path: &Path, cause: io::Error) -> ReadError {
    let part = part_path(path);
    if cause.kind() == io::ErrorKind::NotFound && part.exists() {
        ReadError::Unfinished { part }
    } else {
        cause.into()
    }
}

impl<R: Read> LogReader<R> {
    /// Reads the header of a recording.
    ///
    /// # Errors
    /// If the source is not a recording or has no readable header.
    pub fn new(source: R) -> Result<Self, ReadError> {
        let mut records = RecordReader::new(source);
        let mut library = String::new();
        let mut scene = None;
        loop {
            match records.next(read_header_record)? {
                Some(HeaderRecord::Library(name)) => library = name,
                Some(HeaderRecord::Scene(bytes)) => scene = Some(bytes),
                Some(HeaderRecord::Run(map)) => {
                    if scene.is_none() && !map.contains_key(FORMAT_VERSION_KEY) {
                        return Err(ReadError::Foreign { library });
                    }
                    let (run, scene) = (read_run(&map)?, scene.unwrap_or_default());
                    let limits = SizeLimits::new(&run, scene.len());
                    records.set_limits(limits);
                    let channels = BTreeMap::new();
                    return Ok(Self { records, limits, channels, run, scene, closing: None });
                }
                Some(HeaderRecord::Skipped) => {}
                Some(HeaderRecord::Message) => return Err(ReadError::Foreign { library }),
                None => {
                    return Err(match records.end {
                        Some(LogEnd::Complete) | None => ReadError::Foreign { library },
                        Some(end) if records.is_mcap => ReadError::NoHeader(end),
                        Some(_) => ReadError::NotMcap,
                    });
                }
            }
        }
    }

    pub(in crate::log) fn limits(&self) -> SizeLimits {
        self.limits
    }

    /// Returns the number of bytes of the file that are read and intact.
    pub(in crate::log) fn intact_count(&self) -> u64 {
        self.records.intact_count()
    }

    /// Returns the run that was recorded.
    pub fn run(&self) -> &RunDescription {
        &self.run
    }

    /// Returns the text of the complete effective scene. It is empty if the file has none.
    pub fn scene(&self) -> &[u8] {
        &self.scene
    }

    /// Returns the closing metadata, once the last message has been read.
    pub fn closing(&self) -> Option<&Closing> {
        self.closing.as_ref()
    }

    /// Returns the end of the file, once [`LogReader::next_message`] has returned `None`.
    pub fn end(&self) -> Option<&LogEnd> {
        self.records.end.as_ref()
    }

    /// Returns the next message, or `None` at the end of the readable part. Skips `/tf` and foreign
    /// topics.
    ///
    /// # Errors
    /// If the operating system reports an error or the content of a message is invalid.
    pub fn next_message(&mut self) -> Result<Option<LoggedMessage>, ReadError> {
        loop {
            let (channels, closing, run) = (&mut self.channels, &mut self.closing, &self.run);
            let limits = &self.limits;
            let next = self.records.next(|record, byte| match record {
                Record::Channel(channel) => {
                    channels.insert(channel.id, Topic::from_name(&channel.topic));
                    Ok(None)
                }
                Record::Metadata(metadata) if metadata.name == CLOSING_METADATA => {
                    *closing = Some(Closing::from_map(&metadata.metadata));
                    Ok(None)
                }
                Record::Message { header, data } => {
                    let topic = channels.get(&header.channel_id).copied().flatten();
                    let Some(topic) = topic else { return Ok(None) };
                    let malformed = |what| ReadError::Malformed { topic: topic.name(), byte, what };
                    decode_message(topic, &header, &data, run, limits).map_err(malformed)
                }
                _ => Ok(None),
            })?;
            match next {
                Some(Some(logged)) => return Ok(Some(logged)),
                Some(None) => {}
                None => return Ok(None),
            }
        }
    }
}

impl<R> std::fmt::Debug for LogReader<R> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("LogReader").field("run", &self.run).finish_non_exhaustive()
    }
}

/// A record before the first message, reduced to what the reader uses.
enum HeaderRecord {
    Library(String),
    Scene(Vec<u8>),
    Run(BTreeMap<String, String>),
    Message,
    Skipped,
}

#[allow(clippy::unnecessary_wraps, reason = "the signature that RecordReader requires")]
fn read_header_record(record: Record<'_>, _byte: u64) -> Result<HeaderRecord, ReadError> {
    Ok(match record {
        Record::Header(header) => HeaderRecord::Library(header.library),
        Record::Attachment { header, data, .. } if header.name == SCENE_ATTACHMENT => {
            HeaderRecord::Scene(data.into_owned())
        }
        Record::Metadata(metadata) if metadata.name == RUN_METADATA => {
            HeaderRecord::Run(metadata.metadata)
        }
        Record::Message { .. } | Record::Unknown { opcode: op::CHUNK, .. } => HeaderRecord::Message,
        _ => HeaderRecord::Skipped,
    })
}

fn read_run(map: &BTreeMap<String, String>) -> Result<RunDescription, ReadError> {
    let is_supported = |text: &String| {
        text.parse().is_ok_and(|version| (FORMAT_VERSION_MIN..=FORMAT_VERSION).contains(&version))
    };
    match map.get(FORMAT_VERSION_KEY) {
        Some(text) if is_supported(text) => {}
        Some(text) => return Err(ReadError::Version { found: text.clone() }),
        None => return Err(ReadError::BadRun { key: FORMAT_VERSION_KEY.to_owned() }),
    }
    RunDescription::from_map(map).map_err(|key| ReadError::BadRun { key })
}
