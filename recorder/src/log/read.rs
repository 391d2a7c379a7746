//! Reading a recording from its start: records, messages and snapshots.

pub(super) mod audit;
mod chunk_data;
pub(super) mod decode;
mod fault;
pub(super) mod file_source;
pub(super) mod frames;
pub(super) mod lengths;
pub(super) mod limits;
pub(super) mod open;
pub(super) mod read_error;
pub(super) mod reader;
pub(super) mod records;
pub(super) mod selection;
mod source;
