//! The disk below a part file: space that is allocated ahead of the writes, and the calls that make a file outlive a
//! power cut.

use std::fs::File;
use std::io::ErrorKind::{InvalidInput, PermissionDenied};
use std::io::{self, Write};
use std::path::Path;

use rustix::fs::{FallocateFlags, fallocate};

use crate::file_lock;

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
        file_lock::is_in_place(self, path)
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

/// Size of an allocation, in bytes. Larger ones save no time.
const ALLOCATION_SIZE_BYTES: u64 = 1 << 23;

/// The disk space of a file, which is allocated in large parts, so that no write reserves each block on its own: on
/// ext4, writing takes 0.6 times the processor time. The first [`ALLOCATION_SIZE_BYTES`] are written without, so small files take
/// no more space than they need. A process that is killed may leave that much allocated beyond the end of its file.
#[derive(Debug)]
pub(super) struct Allocation {
    /// Number of bytes that are written, or buffered.
    size_bytes: u64,
    /// End of the allocated space; the greatest number after an error.
    end: u64,
    /// Space may be allocated beyond the end of the file.
    has_unused: bool,
}

impl Allocation {
    /// Begins with an empty file.
    pub(super) fn new() -> Self {
        Self { size_bytes: 0, end: ALLOCATION_SIZE_BYTES, has_unused: false }
    }

    /// Allocates space for the next bytes. After an error, allocates no more: the file system cannot do it, or the disk
    /// is nearly full, and the write itself shows which.
    pub(super) fn make_room<F: DiskFile>(&mut self, count: usize, file: &F) {
        let size_bytes = self.size_bytes + count as u64;
        if size_bytes > self.end {
            let next_end = size_bytes.next_multiple_of(ALLOCATION_SIZE_BYTES);
            let allocated = file.allocate(self.end, next_end - self.end);
            self.end = allocated.map_or(u64::MAX, |()| next_end);
            self.has_unused = true;
        }
    }

    /// Counts the bytes of a successful write.
    pub(super) fn count(&mut self, written: io::Result<usize>) -> io::Result<usize> {
        self.size_bytes += *written.as_ref().unwrap_or(&0) as u64;
        written
    }

    /// Frees the space beyond the end of the written file, and allocates no more.
    pub(super) fn free_unused<F: DiskFile>(&mut self, file: &F) -> io::Result<()> {
        self.end = u64::MAX;
        if std::mem::take(&mut self.has_unused) { file.free_unused() } else { Ok(()) }
    }
}
