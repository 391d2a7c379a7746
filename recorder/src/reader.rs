//! Reads a recording from its start, checking every checksum, as far as the file goes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use mcap::records::{MessageHeader, Record};
use serde::de::DeserializeOwned;

use crate::message::Message;
use crate::protobuf::decode_particles;
use crate::records::{LogEnd, READ_SIZE_BYTES_MAX, RecordReader};
use crate::run::{
    CLOSING_METADATA, Closing, FORMAT_VERSION, FORMAT_VERSION_MIN, RUN_METADATA, RunDescription,
    SCENE_ATTACHMENT,
};
use crate::topic::Topic;

/// The metadata of a run that tells ours from those of others.
const FORMAT_VERSION_KEY: &str = "format_version";

/// Why a file cannot be read as a recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system says no.
    #[error("cannot read it")]
    Io(#[from] std::io::Error),
    /// Another kind of file.
    #[error("is not an MCAP file")]
    NotMcap,
    /// An MCAP file that no recorder of ours wrote.
    #[error(
        "is an MCAP file of '{library}', not a recording of a simulation (no metadata 'run' before its first message)"
    )]
    Foreign {
        /// What the file says that it was written by.
        library: String,
    },
    /// The file ends, or is damaged, before the first message.
    #[error("has no readable head: {0}")]
    NoHead(LogEnd),
    /// Written by another version of the recorder.
    #[error(
        "has format version {found}; this recorder reads versions {FORMAT_VERSION_MIN} to {FORMAT_VERSION}"
    )]
    Version {
        /// What the file says.
        found: String,
    },
    /// The metadata of the run lacks something.
    #[error("its metadata 'run' has no usable '{key}'")]
    BadRun {
        /// What is missing or wrong.
        key: String,
    },
    /// A message whose checksum is right and whose content is not.
    #[error("the message on {topic} that ends before byte {byte} is wrong: {what}")]
    Malformed {
        /// Name of its topic.
        topic: &'static str,
        /// Where in the file.
        byte: u64,
        /// What is wrong with it.
        what: String,
    },
    /// A chunk that is not what was written.
    #[error("the chunk at byte {byte} is damaged: {cause}")]
    DamagedChunk {
        /// Where it begins.
        byte: u64,
        /// What is wrong with it.
        cause: String,
    },
    /// A snapshot without a header.
    #[error("the snapshot of step {step} has no row of its step before it in /steps")]
    NoRow {
        /// The snapshot's step.
        step: u64,
    },
}

/// One message as it stands in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Logged {
    /// What it says.
    pub message: Message,
    /// Low 32 bits of its step.
    pub sequence: u32,
    /// Wall clock of its reception, in nanoseconds since 1970.
    pub log_time_ns: u64,
    /// Wall clock of its step, in nanoseconds since 1970.
    pub publish_time_ns: u64,
}

/// Reads one recording from its start.
///
/// A truncated or damaged file is read as far as it goes; [`LogReader::end`] says so.
pub struct LogReader<R> {
    records: RecordReader<R>,
    channels: BTreeMap<u16, Option<Topic>>,
    run: RunDescription,
    scene: Vec<u8>,
    closing: Option<Closing>,
}

impl LogReader<BufReader<File>> {
    /// Opens a file and reads its head.
    ///
    /// # Errors
    /// If it is no recording, or has no readable head.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::new(BufReader::with_capacity(READ_SIZE_BYTES_MAX, File::open(path)?))
    }
}

impl<R: Read> LogReader<R> {
    /// Reads the head of a recording.
    ///
    /// # Errors
    /// If it is no recording, or has no readable head.
    pub fn new(source: R) -> Result<Self, ReadError> {
        let mut records = RecordReader::new(source);
        let mut library = String::new();
        let mut scene = None;
        loop {
            match records.next(read_head_record)? {
                Some(HeadRecord::Library(name)) => library = name,
                Some(HeadRecord::Scene(bytes)) => scene = Some(bytes),
                Some(HeadRecord::Run(map)) => {
                    if scene.is_none() && !map.contains_key(FORMAT_VERSION_KEY) {
                        return Err(ReadError::Foreign { library });
                    }
                    let (run, scene) = (read_run(&map)?, scene.unwrap_or_default());
                    let channels = BTreeMap::new();
                    return Ok(Self { records, channels, run, scene, closing: None });
                }
                Some(HeadRecord::Skipped) => {}
                Some(HeadRecord::Message) => return Err(ReadError::Foreign { library }),
                None => {
                    return Err(match records.end {
                        Some(LogEnd::Whole) | None => ReadError::Foreign { library },
                        Some(end) if records.is_mcap => ReadError::NoHead(end),
                        Some(_) => ReadError::NotMcap,
                    });
                }
            }
        }
    }

    /// The run that was recorded.
    pub fn run(&self) -> &RunDescription {
        &self.run
    }

    /// The text of the complete effective scene; empty where the file carries none.
    pub fn scene(&self) -> &[u8] {
        &self.scene
    }

    /// How the recording ended; known once the last message has been read.
    pub fn closing(&self) -> Option<&Closing> {
        self.closing.as_ref()
    }

    /// How the file ends; known once [`LogReader::next_message`] gave `None`.
    pub fn end(&self) -> Option<&LogEnd> {
        self.records.end.as_ref()
    }

    /// The next message, or `None` at the end of what is readable. `/tf` and topics of others are
    /// left out.
    ///
    /// # Errors
    /// If the operating system says no, or a message is not what this recorder writes.
    pub fn next_message(&mut self) -> Result<Option<Logged>, ReadError> {
        loop {
            let (channels, closing, run) = (&mut self.channels, &mut self.closing, &self.run);
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
                    let wrong = |what| ReadError::Malformed { topic: topic.name(), byte, what };
                    read_message(topic, &header, &data, run).map_err(wrong)
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

/// What matters of a record before the first message.
enum HeadRecord {
    Library(String),
    Scene(Vec<u8>),
    Run(BTreeMap<String, String>),
    Message,
    Skipped,
}

#[allow(clippy::unnecessary_wraps, reason = "the signature that RecordReader asks for")]
fn read_head_record(record: Record<'_>, _byte: u64) -> Result<HeadRecord, ReadError> {
    Ok(match record {
        Record::Header(header) => HeadRecord::Library(header.library),
        Record::Attachment { header, data, .. } if header.name == SCENE_ATTACHMENT => {
            HeadRecord::Scene(data.into_owned())
        }
        Record::Metadata(metadata) if metadata.name == RUN_METADATA => {
            HeadRecord::Run(metadata.metadata)
        }
        Record::Message { .. } => HeadRecord::Message,
        _ => HeadRecord::Skipped,
    })
}

fn read_run(map: &BTreeMap<String, String>) -> Result<RunDescription, ReadError> {
    let is_read = |found: &String| {
        found.parse().is_ok_and(|one| (FORMAT_VERSION_MIN..=FORMAT_VERSION).contains(&one))
    };
    match map.get(FORMAT_VERSION_KEY) {
        Some(found) if is_read(found) => {}
        Some(found) => return Err(ReadError::Version { found: found.clone() }),
        None => return Err(ReadError::BadRun { key: FORMAT_VERSION_KEY.to_owned() }),
    }
    RunDescription::from_map(map).map_err(|key| ReadError::BadRun { key })
}

/// `None` for a topic that is not read back.
pub(crate) fn read_message(
    topic: Topic,
    header: &MessageHeader,
    data: &[u8],
    run: &RunDescription,
) -> Result<Option<Logged>, String> {
    let step = || run.step_at(header.publish_time).ok_or("its time is that of no step".to_owned());
    let message = match topic {
        Topic::Tf => return Ok(None),
        Topic::Topology => Message::Topology(row(data)?),
        Topic::Surface => Message::Surface(row(data)?),
        Topic::Colliders => Message::Colliders(row(data)?),
        Topic::Tears => Message::Tears(row(data)?),
        Topic::Outcomes => Message::Outcome(row(data)?),
        Topic::Status => Message::Status(row(data)?),
        Topic::Events => Message::Event(row(data)?),
        Topic::Steps => Message::Step(row(data)?),
        Topic::Keyframe => Message::Keyframe { step: step()?, bytes: data.to_vec() },
        Topic::Particles => {
            Message::Particles { step: step()?, particles: decode_particles(data)? }
        }
    };
    Ok(Some(Logged {
        message,
        sequence: header.sequence,
        log_time_ns: header.log_time,
        publish_time_ns: header.publish_time,
    }))
}

fn row<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    serde_json::from_slice(data).map_err(|error| error.to_string())
}
