//! The place and the lock of an open file.

use std::fs::{self, File, Metadata, TryLockError};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Returns `true` if a path still names an open file. Another process may have removed, renamed or
/// replaced it in the meantime.
pub(crate) fn is_in_place(file: &File, path: &Path) -> bool {
    let inode = |metadata: Metadata| (metadata.dev(), metadata.ino());
    let (open, named) = (file.metadata().map(inode), fs::metadata(path).map(inode));
    matches!((open, named), (Ok(open), Ok(named)) if open == named)
}

/// Returns `true` if a program of this project is writing a file. Returns `false` if the file cannot be
/// opened.
pub fn is_being_written(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| is_locked(&file))
}

/// Returns `true` if another open file holds the exclusive lock of a file. Otherwise this one holds a
/// shared lock, until it is closed.
pub(crate) fn is_locked(file: &File) -> bool {
    matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
}
