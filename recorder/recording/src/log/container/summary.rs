//! The checks of the index at the end of a file.

use std::collections::BTreeMap;

use mcap::records::{Footer, Record, Statistics, SummaryOffset, op};

use super::places::{Places, chunk_entry_hash, text_hash};

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
