//! The limits at which a file ends and the next one begins.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rustix::fs::statvfs;

use crate::cli::parse::{self, size_bytes};

/// Smallest limit on the size of a file, so that a wrong unit does not fill a folder with tiny files.
const SPLIT_SIZE_MIN_BYTES: u64 = 64 << 10;
/// Shortest limit on the time of a file. Files begin with keyframes, which are a second apart.
const SPLIT_DURATION_MIN: Duration = Duration::from_secs(1);
/// Fewest files of a ring: one is being written, and one is complete.
const FILES_MIN: u64 = 2;

/// Options that divide a recording into files.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct SplitArgs {
    /// Go on in the next file at the first keyframe after this size, such as 100MB or 2GiB, at least
    /// 64KiB. A running node publishes a keyframe each second
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true, value_parser = split_size)]
    split_size: Option<u64>,
    /// Go on in the next file at the first keyframe after this time, such as 10min, at least 1s
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = split_duration)]
    split_duration: Option<Duration>,
    /// Keep the newest N files, at least 2, and remove older ones. A recorder with the same name goes on with the
    /// next number, and the files before it count
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = file_count)]
    max_files: Option<u64>,
    /// While less than this is free on the disk, such as 10GB, remove the oldest file at each flush. A recording
    /// in a single file ends instead
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true, value_parser = size_bytes)]
    min_free: Option<u64>,
}

/// The limits at which a recording removes its oldest files.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ring {
    /// Most files to keep.
    pub(crate) files_max: Option<u64>,
    /// Least free space of the disk, in bytes.
    pub(crate) free_min_bytes: Option<u64>,
}

impl Ring {
    /// Returns `true` if there is a limit.
    pub(crate) fn is_given(self) -> bool {
        self.files_max.is_some() || self.free_min_bytes.is_some()
    }

    /// Returns `true` if less than the reserve is free on the disk of a file. Unknown space is enough.
    pub(crate) fn is_short(self, path: &Path) -> bool {
        let free_bytes = self.free_min_bytes.and_then(|_| free_bytes(path));
        free_bytes.zip(self.free_min_bytes).is_some_and(|(free, free_min)| free < free_min)
    }
}

impl SplitArgs {
    /// Returns `true` if a limit divides the recording into files.
    pub(crate) fn is_given(&self) -> bool {
        self.split_size.is_some() || self.split_duration.is_some()
    }

    /// Returns the limits of a ring of files.
    pub(crate) fn ring(&self) -> Ring {
        Ring { files_max: self.max_files, free_min_bytes: self.min_free }
    }
}

/// Returns the free space of the disk of a file, in bytes; `None` if it is unknown.
fn free_bytes(path: &Path) -> Option<u64> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let disk = statvfs(folder.unwrap_or(Path::new("."))).ok()?;
    Some(disk.f_bavail * disk.f_frsize)
}

fn split_size(text: &str) -> Result<u64, String> {
    let size = size_bytes(text)?;
    if size < SPLIT_SIZE_MIN_BYTES { Err("it must be at least 64KiB".to_owned()) } else { Ok(size) }
}

fn split_duration(text: &str) -> Result<Duration, String> {
    let duration = parse::duration(text)?;
    if duration < SPLIT_DURATION_MIN {
        Err("it must be at least 1s".to_owned())
    } else {
        Ok(duration)
    }
}

fn file_count(text: &str) -> Result<u64, String> {
    parse::whole_number_in(text, &(FILES_MIN..=u64::MAX))
}

/// The file that the writing thread writes, for the reading thread.
#[derive(Debug, Default)]
pub(crate) struct WritePosition {
    file: Mutex<Option<FilePosition>>,
    /// The disk has less free space than its reserve.
    is_short: AtomicBool,
}

#[derive(Debug, Clone, Copy)]
struct FilePosition {
    number: u64,
    size_bytes: u64,
}

impl WritePosition {
    pub(crate) fn set(&self, number: u64, size_bytes: u64) {
        *self.file.lock().unwrap_or_else(PoisonError::into_inner) =
            Some(FilePosition { number, size_bytes });
    }

    /// Ends the recording, because the disk has less free space than its reserve.
    pub(crate) fn end_for_reserve(&self) {
        self.is_short.store(true, Ordering::Relaxed);
    }

    /// Returns `true` if the recording ends for the reserve of its disk.
    pub(crate) fn ends_for_reserve(&self) -> bool {
        self.is_short.load(Ordering::Relaxed)
    }

    /// Returns the number and the size of the file.
    pub(crate) fn get(&self) -> Option<(u64, u64)> {
        let position = *self.file.lock().unwrap_or_else(PoisonError::into_inner);
        position.map(|position| (position.number, position.size_bytes))
    }

    /// Returns the size of a file; `None` if the writing thread has not begun it.
    fn size_bytes_of(&self, number: u64) -> Option<u64> {
        let position = *self.file.lock().unwrap_or_else(PoisonError::into_inner);
        position.filter(|position| position.number == number).map(|position| position.size_bytes)
    }
}

/// The begin of the newest file in the queue.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FileBegin {
    /// Counted from 0.
    pub(crate) number: u64,
    /// CLOCK_MONOTONIC, in nanoseconds.
    pub(crate) monotonic_ns: u64,
}

impl SplitArgs {
    /// Returns `true` if a file has reached a limit. `waiting_bytes` wait to be written. While a stalled
    /// disk keeps the writing thread in an earlier file, no further one begins.
    pub(crate) fn is_due(
        &self,
        file: FileBegin,
        position: &WritePosition,
        waiting_bytes: usize,
        now_ns: u64,
    ) -> bool {
        let Some(size_bytes) = position.size_bytes_of(file.number) else { return false };
        let size_bytes = size_bytes + waiting_bytes as u64;
        let age = Duration::from_nanos(now_ns.saturating_sub(file.monotonic_ns));
        self.split_size.is_some_and(|limit| size_bytes >= limit)
            || self.split_duration.is_some_and(|limit| age >= limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: FileBegin = FileBegin { number: 3, monotonic_ns: 1_000_000_000 };

    #[test]
    fn a_file_ends_at_its_size_or_its_time_once_the_writing_thread_has_begun_it() {
        let args = SplitArgs {
            split_size: Some(1000),
            split_duration: Some(Duration::from_secs(10)),
            ..SplitArgs::default()
        };
        let position = WritePosition::default();
        let is_due = |waiting, now_ns| args.is_due(FILE, &position, waiting, now_ns);
        assert!(!is_due(5000, 20_000_000_000), "not begun");
        position.set(2, 5000);
        assert!(!is_due(5000, 20_000_000_000), "in the file before");
        position.set(3, 600);
        assert!(!is_due(399, 10_999_999_999));
        assert!(is_due(400, 1_000_000_000));
        assert!(is_due(0, 11_000_000_000));
    }

    #[test]
    fn limits_state_their_range() {
        assert_eq!(split_size("1MiB"), Ok(1 << 20));
        assert_eq!(split_size("1kB").unwrap_err(), "it must be at least 64KiB");
        assert_eq!(split_duration("500ms").unwrap_err(), "it must be at least 1s");
        assert_eq!(file_count("1").unwrap_err(), "it must be a whole number from 2");
    }
}
