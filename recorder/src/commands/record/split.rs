//! The limits at which a file ends and the next one begins, and the end of a recording after a time.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rustix::fs::statvfs;
use sim_contract::SnapshotHeader;
use sim_host::clock::SECOND_NS;

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

/// Longest time that a node is behind its pace before it gives up steps.
const BEHIND_NS: u64 = SECOND_NS / 4;

/// A limit on the time of a recording. It counts from the first recorded step, and until there is one, from the
/// start.
///
/// A node that is late by less than a quarter of a second makes up for it, so the limit waits that long for the
/// steps of its time. A node that is paused or slowed never makes them in time.
#[derive(Debug)]
pub(crate) struct TimeLimit {
    duration: Duration,
    /// CLOCK_MONOTONIC at the first recorded step, or at the start.
    begin_ns: u64,
    first: Option<FirstStep>,
}

/// The first recorded step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstStep {
    pub(crate) run_id: u64,
    pub(crate) step: u64,
    pub(crate) rate_hz: u32,
    pub(crate) publish_monotonic_ns: u64,
}

impl TimeLimit {
    pub(crate) fn new(duration: Duration, now_ns: u64) -> Self {
        Self { duration, begin_ns: now_ns, first: None }
    }

    /// Counts from the publication of this step on, unless another one came before: the step may have waited
    /// for its reader. The bound is for the clock of another host.
    pub(crate) fn begin(&mut self, first: FirstStep, now_ns: u64) {
        if self.first.is_none() {
            let earliest_ns = now_ns.saturating_sub(BEHIND_NS);
            self.begin_ns = first.publish_monotonic_ns.clamp(earliest_ns, now_ns);
            self.first = Some(first);
        }
    }

    /// Returns `true` if the recording ends, where `last` is the last recorded state.
    pub(crate) fn is_reached(&self, last: Option<&SnapshotHeader>, now_ns: u64) -> bool {
        let passed = Duration::from_nanos(now_ns.saturating_sub(self.begin_ns));
        let Some(over) = passed.checked_sub(self.duration) else { return false };
        match (&self.first, last) {
            (Some(first), Some(last)) => {
                first.has_steps_of(self.duration, last) || over >= first.wait(last)
            }
            _ => true,
        }
    }
}

impl FirstStep {
    /// Returns `true` if the steps of a time have been made by the last one. Another run has its own steps.
    fn has_steps_of(&self, duration: Duration, last: &SnapshotHeader) -> bool {
        let steps = last.step.saturating_sub(self.step);
        let needed = duration.as_nanos() * u128::from(self.rate_hz);
        last.run_id != self.run_id || u128::from(steps) * u128::from(SECOND_NS) >= needed
    }

    /// Longest wait for the last steps: that for the next snapshot, and that for a late one.
    fn wait(&self, last: &SnapshotHeader) -> Duration {
        let period_ns = u64::from(last.stride) * SECOND_NS / u64::from(self.rate_hz.max(1));
        Duration::from_nanos(period_ns + BEHIND_NS)
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

#[cfg(test)]
mod time_limit_tests {
    use super::*;

    const DURATION: Duration = Duration::from_secs(5);
    const BEGIN_NS: u64 = SECOND_NS / 10;
    const FIRST: FirstStep =
        FirstStep { run_id: 7, step: 100, rate_hz: 240, publish_monotonic_ns: BEGIN_NS };
    const END_NS: u64 = BEGIN_NS + 5 * SECOND_NS;

    fn at(step: u64) -> SnapshotHeader {
        SnapshotHeader { run_id: 7, step, stride: 1, ..SnapshotHeader::default() }
    }

    fn begun() -> TimeLimit {
        let mut limit = TimeLimit::new(DURATION, 0);
        limit.begin(FIRST, BEGIN_NS);
        limit
    }

    #[test]
    fn the_time_counts_from_the_first_recorded_step() {
        let limit = begun();
        assert!(!limit.is_reached(Some(&at(1300)), END_NS - 1));
        assert!(limit.is_reached(Some(&at(1300)), END_NS));
        let mut later_file = begun();
        later_file.begin(FirstStep { step: 900, ..FIRST }, BEGIN_NS + 3 * SECOND_NS);
        assert!(
            later_file.is_reached(Some(&at(1300)), END_NS),
            "a later file counts from the first"
        );
    }

    #[test]
    fn the_wait_of_the_first_step_for_the_recorder_makes_no_recording_longer() {
        let read_at = |now_ns| {
            let mut limit = TimeLimit::new(DURATION, 0);
            limit.begin(FIRST, now_ns);
            limit
        };
        let late = read_at(BEGIN_NS + SECOND_NS / 5);
        assert!(late.is_reached(Some(&at(1300)), END_NS));
        assert!(!late.is_reached(Some(&at(1299)), END_NS));
        // The clock of another host.
        let now_ns = 1000 * SECOND_NS;
        let other = read_at(now_ns);
        assert!(!other.is_reached(Some(&at(1299)), now_ns + 5 * SECOND_NS));
        assert!(other.is_reached(Some(&at(1300)), now_ns + 5 * SECOND_NS));
    }

    #[test]
    fn without_a_step_the_time_counts_from_the_start() {
        let limit = TimeLimit::new(DURATION, 0);
        assert!(
            !limit.is_reached(None, 5 * SECOND_NS - 1) && limit.is_reached(None, 5 * SECOND_NS)
        );
    }

    #[test]
    fn the_last_steps_of_a_late_node_are_awaited_and_those_of_a_slow_one_are_not() {
        let limit = begun();
        // Step 1300 is 5 s after step 100.
        assert!(!limit.is_reached(Some(&at(1299)), END_NS + BEHIND_NS));
        assert!(limit.is_reached(Some(&at(1300)), END_NS + 1));
        let period_ns = SECOND_NS / 240;
        assert!(limit.is_reached(Some(&at(100)), END_NS + BEHIND_NS + period_ns));
        // With a snapshot each second, the one at step 1300 may come a second later.
        let sparse = SnapshotHeader { stride: 240, ..at(1060) };
        assert!(!limit.is_reached(Some(&sparse), END_NS + SECOND_NS));
    }

    #[test]
    fn the_steps_of_another_run_are_not_counted() {
        let other = SnapshotHeader { run_id: 8, ..at(3) };
        assert!(begun().is_reached(Some(&other), END_NS));
    }
}
