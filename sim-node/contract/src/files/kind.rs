//! The kinds of things that a path may name instead of a regular file.

use std::fs::FileType;
use std::os::unix::fs::FileTypeExt;

/// Returns the kind with its article, or `None` for a regular file.
pub fn kind_of_non_file(file_type: FileType) -> Option<&'static str> {
    match file_type {
        _ if file_type.is_file() => None,
        _ if file_type.is_dir() => Some("a directory"),
        _ if file_type.is_fifo() => Some("a named pipe (FIFO)"),
        _ if file_type.is_socket() => Some("a socket"),
        _ => Some("a device"),
    }
}
