//! Reading a recording from its start: records, messages and snapshots.

pub(super) mod decode;
pub(super) mod frames;
pub(super) mod open;
pub(super) mod read_error;
pub(super) mod reader;
pub(super) mod records;
