//! Positions of chunks, before the ids of their channels are resolved to topics.

use crate::log::read::limits::RECORD_HEADER_SIZE_BYTES;

/// Most chunks of a file. At the usual chunk size this is 1 TB. Their index takes less than 200 MB
/// of memory.
pub(super) const CHUNK_COUNT_MAX: usize = 1 << 20;

/// A chunk with the ids of its channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LocatedChunk {
    pub(super) offset: u64,
    pub(super) size_bytes: u64,
    pub(super) channels: ChannelSet,
}

/// A set of channel ids, as bits: a recording has a dozen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct ChannelSet {
    ids: u64,
    /// The set has an id that does not fit.
    is_unknown: bool,
}

impl ChannelSet {
    pub(super) fn add(&mut self, id: u16) {
        match 1_u64.checked_shl(u32::from(id)) {
            Some(bit) => self.ids |= bit,
            None => self.is_unknown = true,
        }
    }

    /// Returns the ids, or `None` if the file does not list them or they are unknown.
    pub(super) fn known_ids(self) -> Option<impl Iterator<Item = u16>> {
        let is_known = self.ids != 0 && !self.is_unknown;
        is_known.then(|| (0..64).filter(move |id| self.ids >> id & 1 != 0))
    }
}

/// Returns the size of a record including its header. `bytes` starts with the header.
pub(in crate::log) fn record_size_bytes(bytes: &[u8]) -> Option<u64> {
    let length: [u8; 8] = bytes.get(1..9)?.try_into().ok()?;
    u64::from_le_bytes(length).checked_add(RECORD_HEADER_SIZE_BYTES as u64)
}
