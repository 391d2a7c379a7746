//! The positions of the records of a file, and the index at its end, which is compared with them.

use std::collections::BTreeMap;

use mcap::records::{
    AttachmentHeader, ChunkHeader, ChunkIndex, Footer, MessageHeader, MessageIndex, Record,
    Statistics, SummaryOffset, op,
};
use xxhash_rust::xxh3::xxh3_64;

/// Most records whose position is kept: the limit of the index.
const PLACES_MAX: usize = 1 << 20;

/// The positions and counts of a file, as far as it was read.
#[derive(Debug, Default)]
pub(super) struct Places {
    /// Hash of the index entry of each chunk, attachment and metadata record, by position. An entry
    /// that an index must not have is missing.
    pub(super) entries: BTreeMap<u64, u64>,
    pub(super) statistics: Statistics,
    pub(super) schemas: std::collections::BTreeSet<u16>,
    /// The chunk that was read last, until the next record that is no message index.
    chunk: Option<OpenChunk>,
}

/// A chunk whose message indexes are read.
#[derive(Debug)]
struct OpenChunk {
    entry: ChunkIndex,
    /// Times and offsets of the messages, by channel.
    messages: BTreeMap<u16, Vec<(u64, u64)>>,
}

impl Places {
    /// Adds a chunk whose content is read next. `size_bytes` includes the header of the record.
    pub(super) fn begin_chunk(&mut self, byte: u64, size_bytes: u64, header: &ChunkHeader) {
        self.end_chunk();
        self.statistics.chunk_count += 1;
        let entry = ChunkIndex {
            message_start_time: header.message_start_time,
            message_end_time: header.message_end_time,
            chunk_start_offset: byte,
            chunk_length: size_bytes,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression: header.compression.clone(),
            compressed_size: header.compressed_size,
            uncompressed_size: header.uncompressed_size,
        };
        self.chunk = Some(OpenChunk { entry, messages: BTreeMap::new() });
    }

    /// Adds a message. `offset` is its place in the content of its chunk.
    pub(super) fn add_message(&mut self, header: &MessageHeader, offset: u64) {
        let all = &mut self.statistics;
        let is_first = all.message_count == 0;
        let time = header.log_time;
        all.message_start_time = if is_first { time } else { all.message_start_time.min(time) };
        all.message_end_time = all.message_end_time.max(time);
        all.message_count += 1;
        *all.channel_message_counts.entry(header.channel_id).or_default() += 1;
        if let Some(chunk) = &mut self.chunk {
            chunk.messages.entry(header.channel_id).or_default().push((time, offset));
        }
    }

    /// Compares the times in the header of the chunk with those of its messages.
    pub(super) fn check_times(&self) -> Result<(), String> {
        let Some(OpenChunk { entry, messages }) = &self.chunk else { return Ok(()) };
        let times = || messages.values().flatten().map(|(time, _)| *time);
        let expected = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        if (entry.message_start_time, entry.message_end_time) == expected {
            return Ok(());
        }
        Err("the times in its header are not those of its messages".to_owned())
    }

    /// Compares a message index with the chunk before it.
    pub(super) fn check_message_index(
        &mut self,
        byte: u64,
        size_bytes: u64,
        index: &MessageIndex,
    ) -> Result<(), String> {
        let Some(OpenChunk { entry, messages }) = &mut self.chunk else {
            return Err("it follows no readable chunk".to_owned());
        };
        let channel = index.channel_id;
        entry.message_index_length += size_bytes;
        if entry.message_index_offsets.insert(channel, byte).is_some() {
            return Err(format!("a second one of channel {channel}"));
        }
        let found = index.records.iter().map(|one| (one.log_time, one.offset));
        let expected = messages.remove(&channel).unwrap_or_default();
        if expected.into_iter().eq(found) {
            return Ok(());
        }
        Err(format!("its entries are not the messages of channel {channel} in the chunk before it"))
    }

    /// Returns `true` if a readable chunk was read last, with its message indexes so far.
    pub(super) fn has_chunk(&self) -> bool {
        self.chunk.is_some()
    }

    /// Ends the chunk. Returns `true` if a message index is missing.
    pub(super) fn end_chunk(&mut self) -> bool {
        let Some(OpenChunk { entry, messages }) = self.chunk.take() else { return false };
        self.add_entry(entry.chunk_start_offset, chunk_entry_hash(&entry));
        // Without any message index, other tools read the chunk from its start.
        !messages.is_empty() && !entry.message_index_offsets.is_empty()
    }

    /// Adds an attachment. `size_bytes` includes the header of the record.
    pub(super) fn add_attachment(
        &mut self,
        byte: u64,
        size_bytes: u64,
        header: &AttachmentHeader,
        data_size: u64,
    ) {
        self.statistics.attachment_count += 1;
        let AttachmentHeader { log_time, create_time, name, media_type } = header;
        let fields = (size_bytes, log_time, create_time, data_size, name, media_type);
        self.add_entry(byte, text_hash(&format!("{fields:?}")));
    }

    /// Adds a metadata record. `size_bytes` includes the header of the record.
    pub(super) fn add_metadata(&mut self, byte: u64, size_bytes: u64, name: &str) {
        self.statistics.metadata_count += 1;
        self.add_entry(byte, text_hash(&format!("{:?}", (size_bytes, name))));
    }

    fn add_entry(&mut self, byte: u64, hash: u64) {
        if self.entries.len() < PLACES_MAX {
            self.entries.insert(byte, hash);
        }
    }
}

/// Returns the hash of the fields of a chunk's entry.
pub(super) fn chunk_entry_hash(entry: &ChunkIndex) -> u64 {
    text_hash(&format!("{entry:?}"))
}

pub(super) fn text_hash(text: &str) -> u64 {
    xxh3_64(text.as_bytes())
}

/// The index at the end of a file, compared with the records before it.
#[derive(Debug)]
pub(super) struct SummaryCheck {
    /// Position of the first record.
    start: u64,
    /// Position of the first summary offset.
    offset_start: u64,
    /// Start and end of each group of records, by opcode.
    groups: BTreeMap<u8, (u64, u64)>,
    /// Number of index entries.
    entry_count: usize,
    has_statistics: bool,
}

impl SummaryCheck {
    /// Begins at the position after the end of the data.
    pub(super) fn new(start: u64) -> Self {
        Self {
            start,
            offset_start: 0,
            groups: BTreeMap::new(),
            entry_count: 0,
            has_statistics: false,
        }
    }

    /// Checks a record. `Err` describes its difference from the data.
    pub(super) fn check(
        &mut self,
        byte: u64,
        record: &Record<'_>,
        size_bytes: u64,
        places: &mut Places,
    ) -> Result<(), String> {
        let end = byte + size_bytes;
        if !matches!(record, Record::SummaryOffset(_) | Record::Footer(_)) {
            self.groups.entry(record.opcode()).or_insert((byte, end)).1 = end;
        }
        let (at, hash) = match record {
            Record::ChunkIndex(entry) => (entry.chunk_start_offset, chunk_entry_hash(entry)),
            Record::AttachmentIndex(entry) => {
                let (log_time, create_time) = (entry.log_time, entry.create_time);
                let (name, media_type) = (&entry.name, &entry.media_type);
                let fields =
                    (entry.length, log_time, create_time, entry.data_size, name, media_type);
                (entry.offset, text_hash(&format!("{fields:?}")))
            }
            Record::MetadataIndex(entry) => {
                (entry.offset, text_hash(&format!("{:?}", (entry.length, entry.name.as_str()))))
            }
            Record::Statistics(found) => {
                self.has_statistics = true;
                return check_statistics(found, &places.statistics);
            }
            Record::SummaryOffset(offset) => return self.check_offset(byte, offset),
            Record::Footer(footer) => return self.check_footer(footer),
            Record::Schema { .. } | Record::Channel(_) => return Ok(()),
            _ => return Err("it does not belong into the index".to_owned()),
        };
        self.entry_count += 1;
        match places.entries.remove(&at) {
            Some(expected) if expected == hash => Ok(()),
            Some(_) => Err(format!("it does not describe the record at byte {at}")),
            None => Err(format!(
                "no record of its kind begins at byte {at}, or a second entry names it"
            )),
        }
    }

    fn check_offset(&mut self, byte: u64, offset: &SummaryOffset) -> Result<(), String> {
        if self.offset_start == 0 {
            self.offset_start = byte;
        }
        let found = (offset.group_start, offset.group_start.saturating_add(offset.group_length));
        if self.groups.get(&offset.group_opcode) == Some(&found) {
            return Ok(());
        }
        Err(format!("no group of records with opcode {} is there", offset.group_opcode))
    }

    fn check_footer(&self, footer: &Footer) -> Result<(), String> {
        let start = if self.groups.is_empty() { 0 } else { self.start };
        let expected = (start, self.offset_start);
        if (footer.summary_start, footer.summary_offset_start) == expected {
            return Ok(());
        }
        Err("it names other positions than those of the index".to_owned())
    }

    /// Checks that the index has every record.
    pub(super) fn check_complete(&self, places: &Places) -> Result<(), String> {
        if self.groups.is_empty() {
            return Err("the file has no index".to_owned());
        }
        if !places.entries.is_empty() {
            let count = places.entries.len();
            return Err(format!("the index lacks {count} records of the file"));
        }
        if self.has_statistics { Ok(()) } else { Err("the index has no statistics".to_owned()) }
    }
}

fn check_statistics(found: &Statistics, expected: &Statistics) -> Result<(), String> {
    let counts = |one: &Statistics| {
        [
            ("messages", one.message_count),
            ("schemas", u64::from(one.schema_count)),
            ("channels", u64::from(one.channel_count)),
            ("attachments", u64::from(one.attachment_count)),
            ("metadata records", u64::from(one.metadata_count)),
            ("chunks", u64::from(one.chunk_count)),
            ("nanoseconds at the first message", one.message_start_time),
            ("nanoseconds at the last message", one.message_end_time),
        ]
    };
    let mut pairs = counts(found).into_iter().zip(counts(expected));
    if let Some(((name, found), (_, expected))) = pairs.find(|(a, b)| a != b) {
        return Err(format!("it counts {found} {name}, but the file has {expected}"));
    }
    let without_zeros = |one: &Statistics| {
        let counts = one.channel_message_counts.iter();
        counts.filter(|(_, count)| **count > 0).map(|(id, count)| (*id, *count)).collect::<Vec<_>>()
    };
    if without_zeros(found) == without_zeros(expected) {
        return Ok(());
    }
    Err("its number of messages on a channel is not that of the file".to_owned())
}

/// Returns `true` for records of the index.
pub(super) fn is_of_index(opcode: u8) -> bool {
    matches!(
        opcode,
        op::CHUNK_INDEX
            | op::ATTACHMENT_INDEX
            | op::STATISTICS
            | op::METADATA_INDEX
            | op::SUMMARY_OFFSET
            | op::SCHEMA
            | op::CHANNEL
    )
}
