//! Errors of writing a file.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// The reason why a file cannot be created or finished.
#[derive(Debug, thiserror::Error)]
pub enum PartFileError {
    /// A file with this name exists.
    #[error("{} exists (use --overwrite to replace it)", .0.display())]
    Exists(PathBuf),
    /// A `.part` file exists. It may be the only trace of a recording whose recorder was killed.
    #[error(
        "{} exists: the program that wrote it was killed (use --overwrite to replace it)",
        .0.display()
    )]
    PartExists(PathBuf),
    /// Another program is writing the file or its `.part` file. It is never replaced.
    #[error(
        "{} is being written by {}: wait for its end, or name another file",
        path.display(),
        process_id.map_or("another program".to_owned(), |id| format!("process {id}"))
    )]
    InUse {
        /// The file.
        path: PathBuf,
        /// The process, if the system names it.
        process_id: Option<u32>,
    },
    /// Another program has moved, replaced or removed the `.part` file.
    #[error(
        "{} is no longer the file that was written: another program has moved, replaced or removed it",
        .0.display()
    )]
    Moved(PathBuf),
    /// The name belongs to a directory or a device, for example. It is never replaced.
    #[error("{} is {kind}; name a file", path.display())]
    NotAFile {
        /// The name.
        path: PathBuf,
        /// The kind of the thing with this name, with its article.
        kind: &'static str,
    },
    /// The operating system reports an error.
    #[error("cannot write {}: {}", path.display(), explain_write_error(cause))]
    Io {
        /// The file.
        path: PathBuf,
        /// The error.
        cause: io::Error,
    },
    /// The finished file keeps the name `NAME.part`.
    #[error("{error}; the complete file is {}", part_path.display())]
    NotRenamed {
        /// The file.
        part_path: PathBuf,
        /// The reason.
        error: Box<PartFileError>,
    },
    /// The file is finished and has its name, but the name is not on the disk.
    #[error("{} is complete, but its name may not survive a power cut: {cause}", path.display())]
    NameNotSynced {
        /// The file.
        path: PathBuf,
        /// The error.
        cause: io::Error,
    },
}

impl PartFileError {
    /// Returns `true` if the file is complete, under one of its names.
    pub fn leaves_complete_file(&self) -> bool {
        matches!(self, Self::NotRenamed { .. } | Self::NameNotSynced { .. })
    }
}

/// Returns the text of an error of writing, with the remedy for a limit.
pub fn explain_write_error(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::FileTooLarge => {
            format!("{error}: the limit on the size of files is reached (see `ulimit -f`)")
        }
        ErrorKind::NotFound => format!("{error}: the folder must exist"),
        ErrorKind::StorageFull => format!("{error}: free space, or name a file on another disk"),
        ErrorKind::QuotaExceeded => format!("{error}: your quota of this disk is used up"),
        _ => error.to_string(),
    }
}

pub(super) fn io_error(path: &Path, cause: io::Error) -> PartFileError {
    PartFileError::Io { path: path.to_owned(), cause }
}
