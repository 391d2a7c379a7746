//! Random access to the chunks of a recording.
//!
//! The index at the end of the file gives the position and the topics of each chunk. A file
//! without an end (its recorder was killed or is still writing) is scanned from record to record
//! instead. The scan reads only the headers of the records.

mod located;

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read};

use mcap::records::{Record, op};
use sim_messages::StopFlag;

use super::read::decode::{LoggedMessage, MessageDecoder};
use super::read::reader::{ChunkStart, LogReader};
use super::read::records::parse_inner;
use super::read_error::{LogEnd, ReadError, check_stop};
use super::run::RunDescription;
use super::scanner::chunk::{Chunk, ChunkContent, InnerRecords};
use super::scanner::limits::{RECORD_HEADER_SIZE_BYTES, SizeLimits};
use super::scanner::split_header;
use super::source::FileSource;
use super::topic::Topic;
use located::LocatedChunk;
#[cfg(feature = "files")]
pub(super) use located::summary_start;

/// A recording with random access to its chunks. Clones read the same file, also on other threads.
#[derive(Debug, Clone)]
pub struct IndexedLog {
    file: FileSource,
    run: RunDescription,
    scene: Vec<u8>,
    limits: SizeLimits,
    /// `None` if the program does not handle signals.
    stop: Option<StopFlag>,
    channels: BTreeMap<u16, Option<Topic>>,
    chunks: Vec<ChunkEntry>,
    end: LogEnd,
    has_index: bool,
}

/// The position and the topics of a chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChunkEntry {
    /// First byte in the file.
    offset: u64,
    size_bytes: u64,
    topics: TopicSet,
}

/// A set of topics: bit [`Topic::index`] of each.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct TopicSet(u16);

impl TopicSet {
    /// The set for a chunk with unknown content.
    const ALL: Self = Self(u16::MAX);

    fn add(&mut self, topic: Topic) {
        self.0 |= 1 << topic.index();
    }
}

impl ChunkEntry {
    /// Returns `true` if the chunk has messages on any of these topics, or if its topics are
    /// unknown.
    pub fn has_any(&self, topics: &[Topic]) -> bool {
        topics.iter().any(|topic| self.topics.0 & 1 << topic.index() != 0)
    }
}

impl IndexedLog {
    /// Reads the header and the index of an open file. A scan of a file without an index calls `on_progress` with the bytes scanned
    /// and the size of the file. After a signal, this and every later read ends with
    /// [`ReadError::Interrupted`].
    ///
    /// # Errors
    /// If the file is not a recording or has no readable header.
    pub fn of_file(
        file: impl Into<FileSource>,
        stop: Option<&StopFlag>,
        on_progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Self, ReadError> {
        let file = file.into();
        let log = LogReader::of_file(file.at(0), stop)?;
        log.selection().require_all_particles("a reader of single steps")?;
        let limits = log.limits();
        let (run, scene) = (log.run().clone(), log.scene().to_vec());
        let index = located::read_index(file.at(0), stop)?;
        let has_index = index.is_some();
        let (located, end) = match index {
            Some(located) => (located, LogEnd::Complete),
            None => located::scan(file.at(0), stop, on_progress)?,
        };
        let channels = BTreeMap::new();
        let (stop, chunks) = (stop.cloned(), Vec::new());
        let mut log = Self { file, run, scene, limits, stop, channels, chunks, end, has_index };
        log.resolve_topics(&located)?;
        Ok(log)
    }

    /// Resolves channel ids to topics. The first chunk declares the channels, so it is read first.
    fn resolve_topics(&mut self, located: &[LocatedChunk]) -> Result<(), ReadError> {
        let entry = |chunk: &LocatedChunk| ChunkEntry {
            offset: chunk.offset,
            size_bytes: chunk.size_bytes,
            topics: TopicSet::ALL,
        };
        self.chunks = located.iter().map(entry).collect();
        if !self.chunks.is_empty() {
            match self.read_chunk(0) {
                // The chunk may have no messages. Then it has no message index to take ids from.
                Ok(messages) => {
                    let mut topics = TopicSet::default();
                    for logged in &messages {
                        topics.add(logged.message.topic());
                    }
                    self.chunks[0].topics = topics;
                }
                Err(ReadError::DamagedChunk { .. } | ReadError::Malformed { .. }) => {}
                Err(other) => return Err(other),
            }
        }
        for (chunk, located) in self.chunks.iter_mut().zip(located) {
            let Some(ids) = located.channels.known_ids() else { continue };
            let known: Option<Vec<_>> = ids.map(|id| self.channels.get(&id)).collect();
            if let Some(known) = known {
                chunk.topics = TopicSet::default();
                let known = known.into_iter().flatten();
                known.for_each(|topic| chunk.topics.add(*topic));
            }
        }
        Ok(())
    }

    /// Returns a reader of the same file from its start, until a signal arrives.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn reader(&self, stop: &StopFlag) -> Result<LogReader<FileSource>, ReadError> {
        LogReader::of_file(self.file.at(0), Some(stop))
    }

    /// Returns the run that was recorded.
    pub fn run(&self) -> &RunDescription {
        &self.run
    }

    /// Returns the text of the complete effective scene. It is empty if the file has none.
    pub fn scene(&self) -> &[u8] {
        &self.scene
    }

    /// Returns all chunks in the order of the file.
    pub fn chunks(&self) -> &[ChunkEntry] {
        &self.chunks
    }

    /// Returns the end of the file. The content of a chunk is verified when the chunk is read.
    pub fn end(&self) -> &LogEnd {
        &self.end
    }

    /// Returns `true` if the file has an index, and `false` if it was scanned.
    pub fn has_index(&self) -> bool {
        self.has_index
    }

    /// Returns a chunk for a reader of the same file to continue at.
    ///
    /// # Panics
    /// If there is no such chunk.
    pub(in crate::log) fn chunk_start(&self, index: usize) -> ChunkStart<'_> {
        ChunkStart { byte: self.chunks[index].offset, channels: &self.channels }
    }

    /// Reads all messages of a chunk except `/tf` and foreign topics, and verifies its checksum.
    ///
    /// # Errors
    /// If the operating system reports an error, a signal has arrived, the chunk is damaged, or the
    /// content of a message is invalid.
    ///
    /// # Panics
    /// If there is no such chunk.
    pub fn read_chunk(&mut self, index: usize) -> Result<Vec<LoggedMessage>, ReadError> {
        let ChunkEntry { offset, size_bytes, .. } = self.chunks[index];
        let damaged = |cause: String| ReadError::DamagedChunk { byte: offset, cause };
        check_stop(self.stop.as_ref())?;
        let size_bytes_max = self.limits.chunk_record_size_bytes_max();
        if size_bytes > size_bytes_max {
            return Err(damaged(format!(
                "it has {size_bytes} bytes (allowed: up to {size_bytes_max} for its scene)"
            )));
        }
        let mut bytes = vec![0; usize::try_from(size_bytes).unwrap_or(usize::MAX)];
        match self.file.at(offset).read_exact(&mut bytes) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                return Err(damaged("the file is shorter than its index says".to_owned()));
            }
            read => read?,
        }
        let (head, body) = bytes.split_at(bytes.len().min(RECORD_HEADER_SIZE_BYTES));
        if split_header(head) != Some((op::CHUNK, body.len() as u64)) {
            return Err(damaged("no chunk starts here".to_owned()));
        }
        let (channels, run, limits) = (&mut self.channels, &self.run, &self.limits);
        let chunk = Chunk::new(body, limits).map_err(damaged)?;
        let mut content = ChunkContent::default();
        content.read(&chunk).map_err(damaged)?;
        let memory_max = limits.decoded_size_bytes_max();
        let mut memory = 0;
        let mut decoder = MessageDecoder { run, limits, spare: &mut Vec::new() };
        let mut messages = Vec::new();
        for record in InnerRecords::from(content.of(chunk.data), 0) {
            let record = record.and_then(|record| parse_inner(&record)).map_err(damaged)?;
            let (header, data) = match record {
                Record::Message { header, data } => (header, data),
                Record::Channel(channel) => {
                    channels.insert(channel.id, Topic::from_name(&channel.topic));
                    continue;
                }
                _ => continue,
            };
            let channel = channels.get(&header.channel_id).copied().flatten();
            let Some(topic) = channel else { continue };
            let (sequence, byte) = (header.sequence, offset + size_bytes);
            let topic_name = topic.name();
            let malformed = |what| ReadError::Malformed { topic: topic_name, sequence, byte, what };
            let message = decoder.decode(topic, &header, &data).map_err(malformed)?;
            let Some(message) = message else { continue };
            memory += message.size_bytes();
            if memory > memory_max {
                return Err(damaged(format!(
                    "its messages take more than {memory_max} bytes of memory"
                )));
            }
            messages.push(message);
        }
        Ok(messages)
    }
}
