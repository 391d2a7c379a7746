//! The reports of a check and of a repair, and their findings.

use std::fmt;
use std::ops::Range;

use serde::Serialize;

use super::losses::Losses;
use super::lost_load::LostLoad;
use crate::log::topic::AllCounts;

/// The result of the check of a file.
#[derive(Debug)]
pub struct CheckReport {
    /// The differences between the file and what its writer wrote.
    pub findings: Findings,
    /// The content that was checked.
    pub extent: CheckExtent,
}

/// The content of a file that was checked, and the content that could not be.
#[derive(Debug, Clone, Default, Serialize)]
pub struct CheckExtent {
    /// Size of the file.
    pub size_bytes: u64,
    /// Number of chunks.
    pub chunk_count: u64,
    /// Number of messages, those of other programs included.
    pub message_count: u64,
    /// Number of snapshots.
    pub snapshot_count: u64,
    /// The first and the last step of the snapshots.
    pub steps: Option<[u64; 2]>,
    /// Snapshots without a compared hash, because messages before them are missing.
    pub unhashed_count: u64,
    /// Missing messages that the file declares.
    pub declared_missing: u64,
    /// The content that could not be checked, for people.
    pub not_checked: Vec<String>,
}

/// The result of a repair.
#[derive(Debug)]
pub struct RepairReport {
    /// The damage that was found.
    pub findings: Findings,
    /// The content that the output lacks.
    pub losses: Losses,
    /// The checksum of the data is wrong, and no damaged record explains it.
    pub is_uncertain: bool,
    /// The messages of the output. Only `written` is set.
    pub counts: AllCounts,
    /// The first and the last step of the snapshots in the output.
    pub steps: Option<[u64; 2]>,
    /// The load that the output lacks, if it follows from the scene and this.
    pub lost_load: Option<LostLoad>,
    /// The input has its end, so nothing behind it was lost.
    pub has_end: bool,
    /// The bytes after that end, which are not copied.
    pub after_end: Option<AfterEnd>,
    /// The scene, if the input has it.
    pub scene: Option<Vec<u8>>,
}

/// Bytes after the end of a recording, such as a second file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct AfterEnd {
    /// Position of the first one.
    pub byte: u64,
    /// Number of bytes.
    pub size_bytes: u64,
    /// Number of messages in them, as their indexes count.
    pub message_count: u64,
    /// Number of intact chunks in them.
    pub chunk_count: u64,
}

impl AfterEnd {
    /// Returns `true` if messages are in these bytes.
    pub fn has_messages(&self) -> bool {
        self.message_count > 0 || self.chunk_count > 0
    }
}

/// Most findings that a report lists. It counts the others.
const FINDINGS_MAX: usize = 100;

/// A difference between a file and what its writer wrote, or must write.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Position of the record in the file.
    pub byte: u64,
    /// The record, such as "chunk" or "chunk, message on /steps".
    pub record: String,
    /// The difference, for people.
    pub what: String,
    /// The effect of a repair.
    pub cure: Cure,
}

/// The effect of a repair on a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cure {
    /// The damaged part is left out, and declared as missing.
    LeaveOut,
    /// The part is rewritten from the rest of the file. Nothing is missing.
    Rewrite,
    /// Messages are missing, and the file does not say so. They are declared as missing.
    Declare,
}

impl fmt::Display for Cure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::LeaveOut => "`recorder repair` leaves it out and declares it as missing",
            Self::Rewrite => "`recorder repair` rewrites it",
            Self::Declare => "`recorder repair` declares them as missing",
        })
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "byte {}: {}: {}; {}", self.byte, self.record, self.what, self.cure)
    }
}

/// The findings of a check, in the order of discovery.
#[derive(Debug, Default)]
pub struct Findings {
    list: Vec<Finding>,
    count: u64,
}

impl Findings {
    /// Returns the first findings.
    pub fn list(&self) -> &[Finding] {
        &self.list
    }

    /// Returns the number of all findings.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Adds a finding about content that cannot be restored.
    pub(super) fn add(&mut self, byte: u64, record: impl Into<String>, what: impl Into<String>) {
        self.push(byte, record.into(), what.into(), Cure::LeaveOut);
    }

    /// Adds a finding about a part that follows from the rest of the file.
    pub(super) fn add_index(
        &mut self,
        byte: u64,
        record: impl Into<String>,
        what: impl Into<String>,
    ) {
        self.push(byte, record.into(), what.into(), Cure::Rewrite);
    }

    /// Adds a finding about messages that are missing, and that the file does not declare.
    pub(super) fn add_missing(
        &mut self,
        byte: u64,
        record: impl Into<String>,
        what: impl Into<String>,
    ) {
        self.push(byte, record.into(), what.into(), Cure::Declare);
    }

    fn push(&mut self, byte: u64, record: String, what: String, cure: Cure) {
        self.count += 1;
        if self.list.len() < FINDINGS_MAX {
            self.list.push(Finding { byte, record, what, cure });
        }
    }
}

/// Describes bytes after the end of a recording.
pub(super) fn after_end_text(bytes: &Range<u64>) -> String {
    let count = bytes.end - bytes.start;
    format!("{count} other bytes follow the end of the recording, such as a second file")
}

/// Returns the name of a kind of record.
pub(super) fn record_name(opcode: u8) -> &'static str {
    use mcap::records::op;
    match opcode {
        op::HEADER => "header",
        op::FOOTER => "footer",
        op::SCHEMA => "schema",
        op::CHANNEL => "channel",
        op::MESSAGE => "message",
        op::CHUNK => "chunk",
        op::MESSAGE_INDEX => "message index",
        op::CHUNK_INDEX => "chunk index",
        op::ATTACHMENT => "attachment",
        op::ATTACHMENT_INDEX => "attachment index",
        op::STATISTICS => "statistics",
        op::METADATA => "metadata",
        op::METADATA_INDEX => "metadata index",
        op::SUMMARY_OFFSET => "summary offset",
        op::DATA_END => "end of the data",
        _ => "record of another program",
    }
}
