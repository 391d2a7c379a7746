//! The calls that make a file outlive a power cut.

use std::fs::File;
use std::io::ErrorKind::{InvalidInput, PermissionDenied};
use std::io::{self, Write};
use std::path::Path;

use rustix::fs::{FallocateFlags, fallocate};

use crate::files::place;

/// A file that can be synced to disk. Tests replace it, to count calls and to inject errors.
pub trait DiskFile: Write {
    /// Allocates disk space from a position on, beyond the end of the file, which stays where it is.
    fn allocate(&self, position: u64, size_bytes: u64) -> io::Result<()>;

    /// Frees the disk space beyond the end of the file.
    fn free_unused(&self) -> io::Result<()>;

    /// Waits until the contents of the file are on disk.
    fn sync_data(&self) -> io::Result<()>;

    /// Waits until the contents and the size of the file are on disk.
    fn sync_all(&self) -> io::Result<()>;

    /// Returns `true` if a path still names this file.
    fn is_in_place(&self, path: &Path) -> bool;

    /// Waits until the names in the folder of a file are on disk.
    fn sync_folder_of(&self, path: &Path) -> io::Result<()>;
}

impl DiskFile for File {
    fn allocate(&self, position: u64, size_bytes: u64) -> io::Result<()> {
        Ok(fallocate(self, FallocateFlags::KEEP_SIZE, position, size_bytes)?)
    }

    fn free_unused(&self) -> io::Result<()> {
        self.set_len(self.metadata()?.len())
    }

    fn sync_data(&self) -> io::Result<()> {
        Self::sync_data(self)
    }

    fn sync_all(&self) -> io::Result<()> {
        Self::sync_all(self)
    }

    fn is_in_place(&self, path: &Path) -> bool {
        place::is_in_place(self, path)
    }

    fn sync_folder_of(&self, path: &Path) -> io::Result<()> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let synced = Self::open(folder.unwrap_or(Path::new("."))).and_then(|file| file.sync_all());
        match synced {
            // Some network file systems cannot sync a folder, and a folder without read permission
            // cannot be opened. Both can hold files.
            Err(error) if [InvalidInput, PermissionDenied].contains(&error.kind()) => Ok(()),
            result => result,
        }
    }
}
