//! Reading a recording from its start: records, messages and snapshots.

pub(super) mod chunk_data;
pub(super) mod decode;
pub(super) mod fault;
pub(super) mod file_source;
pub(super) mod frames;
pub(super) mod gaps;
pub(super) mod lengths;
pub(super) mod limits;
pub(super) mod open;
pub(super) mod read_error;
pub(super) mod reader;
pub(super) mod records;
pub(super) mod source;
