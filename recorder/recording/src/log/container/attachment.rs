//! A long attachment of another program, which is checked and copied in pieces.

use std::ops::Range;

use mcap::records::AttachmentHeader;

use super::finding::Findings;
use super::places::Places;
use crate::log::read::limits::RECORD_HEADER_SIZE_BYTES;

/// Finding about an attachment with other bytes than its writer wrote.
pub(super) const WRONG_CHECKSUM: &str = "its checksum is wrong";
/// Size of the checksum behind the data.
const CHECKSUM_SIZE_BYTES: u64 = 4;

/// An attachment that is too long for memory.
#[derive(Debug, Clone)]
pub(super) struct LongAttachment {
    pub(super) byte: u64,
    /// Size of the whole record.
    pub(super) size_bytes: u64,
    pub(super) header: AttachmentHeader,
    /// The data in the file.
    pub(super) data: Range<u64>,
}

/// The result of the comparison with the checksum of an attachment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Checksum {
    Right,
    Wrong,
    Missing,
}

impl LongAttachment {
    /// Reads the fields before the data from the first bytes of a record. Returns `None` if its length is
    /// not that of its fields.
    pub(super) fn read(byte: u64, size_bytes: u64, start: &[u8]) -> Option<Self> {
        let mut rest = start.get(RECORD_HEADER_SIZE_BYTES..)?;
        let header = AttachmentHeader {
            log_time: read_u64(&mut rest)?,
            create_time: read_u64(&mut rest)?,
            name: read_text(&mut rest)?,
            media_type: read_text(&mut rest)?,
        };
        let data_size = read_u64(&mut rest)?;
        let data_start = byte + (start.len() - rest.len()) as u64;
        let data = data_start..data_start.checked_add(data_size)?;
        let is_exact = data.end.checked_add(CHECKSUM_SIZE_BYTES)? == byte + size_bytes;
        is_exact.then_some(Self { byte, size_bytes, header, data })
    }

    /// Adds the attachment to a check. Returns a description if it cannot be checked.
    pub(super) fn check(
        &self,
        checksum: Checksum,
        findings: &mut Findings,
        places: &mut Places,
    ) -> Option<String> {
        let data_size = self.data.end - self.data.start;
        places.add_attachment(self.byte, self.size_bytes, &self.header, data_size);
        if checksum == Checksum::Wrong {
            findings.add(self.byte, "attachment", WRONG_CHECKSUM);
        }
        (checksum == Checksum::Missing).then(|| no_checksum(&self.header.name))
    }
}

/// Returns the description of an attachment that cannot be checked.
pub(super) fn no_checksum(name: &str) -> String {
    format!("the attachment '{name}', which has no checksum")
}

fn read_u64(rest: &mut &[u8]) -> Option<u64> {
    let (bytes, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(u64::from_le_bytes(*bytes))
}

fn read_text(rest: &mut &[u8]) -> Option<String> {
    let (length, after) = rest.split_first_chunk()?;
    let (text, after) = after.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *rest = after;
    String::from_utf8(text.to_vec()).ok()
}
