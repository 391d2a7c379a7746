//! The end of a file, and the reasons why a file cannot be read as a recording, signals included.

use std::fmt;
use std::io;
use std::path::PathBuf;

use sim_messages::StopFlag;

use super::run::FORMAT_VERSION;

/// The end of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogEnd {
    /// The file is finished.
    Complete,
    /// The file stops in the middle: its writer was killed or is still writing.
    Truncated {
        /// The file is readable up to this byte.
        byte: u64,
    },
    /// A part of the file differs from what was written.
    Damaged {
        /// The file is readable up to this byte.
        byte: u64,
        /// The error that follows.
        cause: String,
    },
}

impl fmt::Display for LogEnd {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Complete => formatter.write_str("complete"),
            Self::Truncated { byte } => write!(formatter, "truncated after byte {byte}"),
            Self::Damaged { byte, cause } => {
                write!(formatter, "damaged after byte {byte}: {cause}")
            }
        }
    }
}

/// The reason why a file cannot be read as a recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system reports an error.
    #[error("cannot read the file")]
    Io(#[source] io::Error),
    /// A signal ended the reading.
    #[error("interrupted")]
    Interrupted,
    /// The file does not exist, but its unfinished part does.
    #[error(
        "no such file, but {} exists: a recorder is writing it, or one was killed. You can read it \
         as far as it goes",
        part.display()
    )]
    Unfinished {
        /// The unfinished part.
        part: PathBuf,
    },
    /// The file has no bytes.
    #[error(
        "is empty: a recorder that is killed before it has recorded a second leaves such a file"
    )]
    Empty,
    /// The file is not an MCAP file.
    #[error("is not an MCAP file")]
    NotMcap,
    /// An MCAP file that no recorder wrote.
    #[error(
        "is an MCAP file of '{library}', not a recording of a simulation (no metadata 'run' before its first message)"
    )]
    Foreign {
        /// The library that wrote the file, as the file states it.
        library: String,
    },
    /// The file ends or is damaged before the first message.
    #[error("has no readable header: {0}")]
    NoHeader(LogEnd),
    /// The file has a format version that this recorder does not read.
    #[error(
        "has format version {found}; this recorder reads version {FORMAT_VERSION}. Read older recordings with the \
         recorder that wrote them"
    )]
    Version {
        /// The version in the file.
        found: String,
    },
    /// The metadata of the run lacks an entry.
    #[error("its metadata 'run' has no valid '{key}'")]
    BadRun {
        /// The missing or invalid entry.
        key: String,
    },
    /// The declaration of what the recording leaves out is invalid.
    #[error("the metadata `selection` is invalid")]
    BadSelection,
    /// A message with a correct checksum and invalid content.
    #[error(
        "step {sequence}: the message on {topic} that ends before byte {byte} is invalid: {what}"
    )]
    Malformed {
        /// Name of the topic.
        topic: &'static str,
        /// Low 32 bits of the step, as the file states it.
        sequence: u32,
        /// Position in the file.
        byte: u64,
        /// The error in the content.
        what: String,
    },
    /// A chunk that differs from what was written.
    #[error("the chunk at byte {byte} is damaged: {cause}")]
    DamagedChunk {
        /// First byte of the chunk.
        byte: u64,
        /// The error in the chunk.
        cause: String,
    },
    /// More messages without a snapshot than a reader keeps, and than this recorder writes.
    #[error(
        "the messages before byte {byte} that belong to no snapshot yet take more than the \
         {size_bytes_max} bytes of memory that they may; `recorder info` and `viewer-bridge --replay`, \
         which do not collect them, can read the file"
    )]
    TooManyMessages {
        /// Position in the file.
        byte: u64,
        /// The limit for the scene of the file.
        size_bytes_max: usize,
    },
    /// The recording has the particles of some snapshots.
    #[error(
        "has the particles of few steps (--only-commands of its recorder), and {purpose} needs those of all: \
         compute them with `recorder simulate IN.mcap -o OUT.mcap`"
    )]
    OnlyCommands {
        /// The program that needs them.
        purpose: &'static str,
    },
    /// A message behind the snapshot of its step, or behind a later message.
    #[error("the message of step {step} on {topic} is out of order: it follows step {newest_step}")]
    Order {
        /// Name of the topic.
        topic: &'static str,
        /// The step of the message.
        step: u64,
        /// The step before it in the file.
        newest_step: u64,
    },
    /// A header of a snapshot that another one follows.
    #[error("the row of step {step} in /steps is not followed by its snapshot in /particles")]
    NoSnapshot {
        /// The step of the row.
        step: u64,
    },
    /// A snapshot without a header.
    #[error("the snapshot of step {step} is not preceded by its row in /steps")]
    NoRow {
        /// The step of the snapshot.
        step: u64,
    },
}

/// The content of the error of a read after a signal.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
struct Interrupted;

/// Returns an error after a signal.
pub(super) fn check_stop(stop: Option<&StopFlag>) -> io::Result<()> {
    match stop {
        Some(stop) if stop.is_requested() => Err(io::Error::other(Interrupted)),
        _ => Ok(()),
    }
}

impl From<io::Error> for ReadError {
    fn from(error: io::Error) -> Self {
        let cause = error.get_ref().and_then(|inner| inner.downcast_ref());
        if let Some(Interrupted) = cause { Self::Interrupted } else { Self::Io(error) }
    }
}

impl From<ReadError> for io::Error {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Io(error) => error,
            ReadError::Interrupted => Self::other(Interrupted),
            other => Self::other(other),
        }
    }
}
