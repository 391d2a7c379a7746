//! The kind of a file, its place, and the lock that keeps two programs from writing it.

use std::fs::{self, File, FileType, Metadata, TryLockError};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

use rustix::fs::{major, minor};

/// Returns the kind of a file with its article, such as "a directory"; `None` for a regular file.
pub fn kind_of_non_file(file_type: FileType) -> Option<&'static str> {
    match file_type {
        _ if file_type.is_file() => None,
        _ if file_type.is_dir() => Some("a directory"),
        _ if file_type.is_fifo() => Some("a named pipe (FIFO)"),
        _ if file_type.is_socket() => Some("a socket"),
        _ => Some("a device"),
    }
}

/// Returns `true` if a path still names an open file. Another process may have removed, renamed or
/// replaced it in the meantime.
pub fn is_in_place(file: &File, path: &Path) -> bool {
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
pub fn is_locked(file: &File) -> bool {
    matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
}

/// Result of locking a file that is open for writing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lock {
    /// This process holds the lock until it closes the file.
    Held,
    /// Another open file holds the lock.
    Taken {
        /// Its process, if the system names one.
        process_id: Option<u32>,
    },
    /// The path names another file by now, or none: the lock is useless.
    Moved,
}

/// Locks a file that was opened as `path`. A file system without locks cannot refuse a second writer.
pub(crate) fn lock(file: &File, path: &Path) -> Lock {
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        return Lock::Taken { process_id: holder(file) };
    }
    // The writer that held the lock before may have renamed the file when it finished.
    if is_in_place(file, path) { Lock::Held } else { Lock::Moved }
}

/// Returns the process that holds the lock of a file.
pub(crate) fn holder(file: &File) -> Option<u32> {
    let file = file.metadata().ok()?;
    let device = file.dev();
    let id = format!("{:02x}:{:02x}:{}", major(device), minor(device), file.ino());
    find_holder(&fs::read_to_string("/proc/locks").ok()?, &id)
}

/// Returns the process of the lock on a file in the text of `/proc/locks`, whose lines read
/// `NUMBER: FLOCK ADVISORY WRITE PROCESS MAJOR:MINOR:INODE START END`.
fn find_holder(locks: &str, id: &str) -> Option<u32> {
    locks.lines().find_map(|line| {
        let fields: Vec<_> = line.split_whitespace().collect();
        let [_, "FLOCK", _, _, process_id, file, ..] = fields[..] else { return None };
        if file == id { process_id.parse().ok() } else { None }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_renamed_before_it_could_be_locked_is_noticed() {
        let path = std::env::temp_dir().join(format!("moved-{}", getrandom::u64().unwrap()));
        let renamed = path.with_extension("finished");
        let file = File::create_new(&path).unwrap();
        fs::rename(&path, &renamed).unwrap();
        assert_eq!(lock(&file, &path), Lock::Moved);
        fs::rename(&renamed, &path).unwrap();
        assert_eq!(lock(&file, &path), Lock::Held);
        fs::remove_file(&path).unwrap();
    }

    #[test]
    fn the_holder_of_a_lock_is_found_by_its_file() {
        let locks = "1: POSIX  ADVISORY  READ 77 08:02:12 128 128\n\
                     2: FLOCK  ADVISORY  WRITE 1234 fd:01:12 0 EOF\n\
                     2: -> FLOCK  ADVISORY  WRITE 99 08:02:12 0 EOF\n\
                     3: FLOCK  ADVISORY  WRITE 4321 08:02:12 0 EOF\n";
        assert_eq!(find_holder(locks, "08:02:12"), Some(4321), "not a waiter or another kind");
        assert_eq!(find_holder(locks, "fd:01:12"), Some(1234));
        assert_eq!(find_holder(locks, "08:02:13"), None);
    }
}
