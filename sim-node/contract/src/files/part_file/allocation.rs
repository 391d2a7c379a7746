//! Disk space that is allocated ahead of the writes.

use std::io;

use super::disk::DiskFile;

/// Size of an allocation, in bytes. Larger ones save no time.
const SIZE_BYTES: u64 = 1 << 23;

/// The disk space of a file, which is allocated in large parts, so that no write reserves each block on its own: on
/// ext4, writing takes 0.6 times the processor time. The first [`SIZE_BYTES`] are written without, so small files take
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
        Self { size_bytes: 0, end: SIZE_BYTES, has_unused: false }
    }

    /// Allocates space for the next bytes. After an error, allocates no more: the file system cannot do it, or the disk
    /// is nearly full, and the write itself shows which.
    pub(super) fn make_room<F: DiskFile>(&mut self, count: usize, file: &F) {
        let size_bytes = self.size_bytes + count as u64;
        if size_bytes > self.end {
            let next_end = size_bytes.next_multiple_of(SIZE_BYTES);
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
