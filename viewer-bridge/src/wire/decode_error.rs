//! Errors of the decoder.

use thiserror::Error;

/// The reason for which bytes are not a message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DecodeError {
    /// The bytes end too early.
    #[error("the message ends at byte {at}, where {needed} more are needed")]
    TooShort {
        /// Place of the missing field.
        at: usize,
        /// Size of the missing field.
        needed: usize,
    },
    /// Bytes follow the end of the message.
    #[error("{extra} bytes follow the end of the message")]
    TooLong {
        /// Number of extra bytes.
        extra: usize,
    },
    /// The kind or its version is unknown.
    #[error("kind {kind} of version {version} is unknown")]
    Unknown {
        /// Kind.
        kind: u16,
        /// Version of the kind.
        version: u16,
    },
    /// The JSON of a scene is invalid.
    #[error("the JSON of the scene is invalid: {detail}")]
    Json {
        /// Error of the parser.
        detail: String,
    },
}
