//! The reasons why a file cannot be read further.

use std::io;

use mcap::McapError;

/// The reason why a file cannot be read further.
#[derive(Debug)]
pub(in crate::log) enum Fault {
    /// The operating system reports an error.
    Io(io::Error),
    /// The file ends within a record.
    Truncated,
    /// The file differs from what was written.
    Damaged(String),
}

impl Fault {
    /// Returns the fault of a part that is longer than the scene of the file can need.
    pub(super) fn too_large(part: &str, size_bytes: u64, size_bytes_max: u64) -> Self {
        Self::Damaged(format!(
            "{part} of {size_bytes} bytes (allowed: up to {size_bytes_max} for its scene)"
        ))
    }
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<McapError> for Fault {
    fn from(error: McapError) -> Self {
        match error {
            McapError::UnexpectedEof => Self::Truncated,
            other => Self::Damaged(other.to_string()),
        }
    }
}
