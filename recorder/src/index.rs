//! A recording that is read from any place, chunk by chunk.
//!
//! Where its chunks are, and which topics each of them has, stands in the index at the end of the
//! file. A file without an end (its recorder was killed, or still writes) is walked from record to
//! record instead: only the heads of records are read, so this takes no longer than the disk needs
//! to find them.

mod summary;
mod walk;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::os::unix::fs::FileExt;
use std::path::Path;

use mcap::records::{Record, op};

use crate::reader::{LogReader, Logged, ReadError, read_message};
use crate::records::{LogEnd, RECORD_SIZE_BYTES_MAX, RecordReader};
use crate::run::RunDescription;
use crate::topic::Topic;

/// Most chunks of a file. With the usual size of a chunk it is 4 TB; a file of more is not ours.
const CHUNK_COUNT_MAX: usize = 1 << 22;
/// Bytes of a record's head: what it is, and its length.
const RECORD_HEAD_SIZE_BYTES: usize = 9;

/// A recording that is read from any place.
#[derive(Debug)]
pub struct IndexedLog {
    file: File,
    run: RunDescription,
    scene: Vec<u8>,
    channels: BTreeMap<u16, Option<Topic>>,
    chunks: Vec<ChunkEntry>,
    end: LogEnd,
    has_index: bool,
}

/// Where a chunk is, and what is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkEntry {
    /// Its first byte in the file.
    offset: u64,
    size_bytes: u64,
    topics: Topics,
}

/// A set of topics: bit [`Topic::index`] of each.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Topics(u16);

impl Topics {
    /// Of a chunk of which nothing is known.
    const ALL: Self = Self(u16::MAX);

    fn add(&mut self, topic: Topic) {
        self.0 |= 1 << topic.index();
    }
}

impl ChunkEntry {
    /// Whether messages of one of these topics are in it; where the file does not say, they may be.
    pub fn has_any(&self, topics: &[Topic]) -> bool {
        topics.iter().any(|topic| self.topics.0 & 1 << topic.index() != 0)
    }
}

/// A chunk with the numbers of its channels, before these have names.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FoundChunk {
    offset: u64,
    size_bytes: u64,
    /// Empty where the file does not say.
    channels: Vec<u16>,
}

impl IndexedLog {
    /// Opens a file, and reads its head and its index.
    ///
    /// # Errors
    /// If it is no recording, or has no readable head.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::open_telling(path, &mut |_, _| {})
    }

    /// The same; `on_walk` is told how many bytes of how many have been looked through, if there is
    /// no index.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_telling(path: &Path, on_walk: &mut dyn FnMut(u64, u64)) -> Result<Self, ReadError> {
        let log = LogReader::open(path)?;
        let (run, scene) = (log.run().clone(), log.scene().to_vec());
        let mut file = File::open(path)?;
        let size_bytes = file.metadata()?.len();
        let summary = summary::read(&mut file, size_bytes)?;
        let has_index = summary.is_some();
        let (found, end) = match summary {
            Some(found) => (found, LogEnd::Whole),
            None => walk::read(&file, size_bytes, on_walk)?,
        };
        let channels = BTreeMap::new();
        let mut log = Self { file, run, scene, channels, chunks: Vec::new(), end, has_index };
        log.name_topics(&found)?;
        Ok(log)
    }

    /// Channels are named in the first chunk, and their topics are asked for before it is read.
    fn name_topics(&mut self, found: &[FoundChunk]) -> Result<(), ReadError> {
        let entry = |found: &FoundChunk, topics| ChunkEntry {
            offset: found.offset,
            size_bytes: found.size_bytes,
            topics,
        };
        self.chunks = found.iter().map(|found| entry(found, Topics::ALL)).collect();
        if !self.chunks.is_empty() {
            match self.read_chunk(0) {
                // It may have channels and no messages, which its indexes do not tell.
                Ok(messages) => {
                    let mut topics = Topics::default();
                    for logged in &messages {
                        topics.add(logged.message.topic());
                    }
                    self.chunks[0].topics = topics;
                }
                Err(ReadError::DamagedChunk { .. } | ReadError::Malformed { .. }) => {}
                Err(other) => return Err(other),
            }
        }
        for (chunk, found) in self.chunks.iter_mut().zip(found) {
            let known: Option<Vec<_>> =
                found.channels.iter().map(|id| self.channels.get(id)).collect();
            if let Some(known) = known.filter(|known| !known.is_empty()) {
                chunk.topics = Topics::default();
                known.into_iter().flatten().for_each(|topic| chunk.topics.add(*topic));
            }
        }
        Ok(())
    }

    /// Another reader of the same file, for another thread.
    ///
    /// # Errors
    /// If the operating system says no.
    pub fn try_clone(&self) -> Result<Self, ReadError> {
        Ok(Self {
            file: self.file.try_clone()?,
            run: self.run.clone(),
            scene: self.scene.clone(),
            channels: self.channels.clone(),
            chunks: self.chunks.clone(),
            end: self.end.clone(),
            has_index: self.has_index,
        })
    }

    /// The run that was recorded.
    pub fn run(&self) -> &RunDescription {
        &self.run
    }

    /// The text of the complete effective scene; empty where the file carries none.
    pub fn scene(&self) -> &[u8] {
        &self.scene
    }

    /// All chunks in the order of the file.
    pub fn chunks(&self) -> &[ChunkEntry] {
        &self.chunks
    }

    /// How the file ends. What is inside its chunks is checked when they are read.
    pub fn end(&self) -> &LogEnd {
        &self.end
    }

    /// Whether the file has its index; without one it was walked.
    pub fn has_index(&self) -> bool {
        self.has_index
    }

    /// All messages of a chunk, but for `/tf` and topics of others, if its checksum is right.
    ///
    /// # Errors
    /// If the operating system says no, the chunk is damaged, or a message is not what a recorder
    /// writes.
    ///
    /// # Panics
    /// If there is no such chunk.
    pub fn read_chunk(&mut self, index: usize) -> Result<Vec<Logged>, ReadError> {
        let ChunkEntry { offset, size_bytes, .. } = self.chunks[index];
        let damaged = |cause: String| ReadError::DamagedChunk { byte: offset, cause };
        if size_bytes > RECORD_SIZE_BYTES_MAX as u64 {
            return Err(damaged("its length is beyond any chunk's".to_owned()));
        }
        let mut bytes = vec![0; usize::try_from(size_bytes).unwrap_or(usize::MAX)];
        // Not from where the file stands: a clone of this stands there too.
        match self.file.read_exact_at(&mut bytes, offset) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                return Err(damaged("the file has become shorter".to_owned()));
            }
            read => read?,
        }
        if bytes.first() != Some(&op::CHUNK) || record_size_bytes(&bytes) != Some(size_bytes) {
            return Err(damaged("no chunk begins here".to_owned()));
        }
        let mut records = RecordReader::of_records(bytes.as_slice());
        let (channels, run) = (&mut self.channels, &self.run);
        let mut messages = Vec::new();
        while let Some(message) = records.next(|record, _| match record {
            Record::Channel(channel) => {
                channels.insert(channel.id, Topic::from_name(&channel.topic));
                Ok(None)
            }
            Record::Message { header, data } => {
                let topic = channels.get(&header.channel_id).copied().flatten();
                let Some(topic) = topic else { return Ok(None) };
                let byte = offset + size_bytes;
                let wrong = |what| ReadError::Malformed { topic: topic.name(), byte, what };
                read_message(topic, &header, &data, run).map_err(wrong)
            }
            _ => Ok(None),
        })? {
            messages.extend(message);
        }
        match records.end {
            Some(LogEnd::Whole) | None => Ok(messages),
            Some(LogEnd::Truncated { .. }) => Err(damaged("it ends too early".to_owned())),
            Some(LogEnd::Damaged { cause, .. }) => Err(damaged(cause)),
        }
    }
}

/// The size of a record with its head, which these bytes begin with.
fn record_size_bytes(bytes: &[u8]) -> Option<u64> {
    let length: [u8; 8] = bytes.get(1..9)?.try_into().ok()?;
    u64::from_le_bytes(length).checked_add(RECORD_HEAD_SIZE_BYTES as u64)
}
