//! Reading a recording from its start: records, messages and snapshots.

pub(super) mod decode;
pub(super) mod frames;
pub(super) mod gaps;
pub(super) mod reader;
pub(super) mod records;
