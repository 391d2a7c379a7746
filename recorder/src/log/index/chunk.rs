//! Positions of chunks, before the ids of their channels are resolved to topics.

/// Most chunks of a file. At the usual chunk size this is 4 TB.
pub(super) const CHUNK_COUNT_MAX: usize = 1 << 22;
/// Size of a record's header: opcode and length.
pub(super) const RECORD_HEADER_SIZE_BYTES: usize = 9;

/// A chunk with the ids of its channels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LocatedChunk {
    pub(super) offset: u64,
    pub(super) size_bytes: u64,
    /// Empty if the file does not list them.
    pub(super) channels: Vec<u16>,
}

/// Returns the size of a record including its header. `bytes` starts with the header.
pub(super) fn record_size_bytes(bytes: &[u8]) -> Option<u64> {
    let length: [u8; 8] = bytes.get(1..9)?.try_into().ok()?;
    u64::from_le_bytes(length).checked_add(RECORD_HEADER_SIZE_BYTES as u64)
}
