//! The clocks. Outside the node, programs of this workspace read a clock only through this module.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::time::{Duration, Instant};

use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

/// Nanoseconds in a second.
pub const SECOND_NS: u64 = 1_000_000_000;

/// CLOCK_MONOTONIC in nanoseconds: the clock of `SnapshotHeader::publish_monotonic_ns`.
pub fn monotonic_ns() -> u64 {
    nanoseconds(clock_gettime(ClockId::Monotonic))
}

/// CLOCK_REALTIME in nanoseconds since 1970.
pub fn realtime_ns() -> u64 {
    nanoseconds(clock_gettime(ClockId::Realtime))
}

/// Processor time of the calling thread in nanoseconds.
pub fn thread_time_ns() -> u64 {
    nanoseconds(clock_gettime(ClockId::ThreadCPUTime))
}

/// Sleeps until CLOCK_MONOTONIC reaches `deadline_ns`. A signal ends the sleep early. The deadline
/// is absolute, so that lateness does not accumulate over the steps.
pub fn sleep_until(deadline_ns: u64) {
    #[allow(clippy::cast_possible_wrap, reason = "centuries since boot fit into i64")]
    let deadline = Timespec {
        tv_sec: (deadline_ns / SECOND_NS) as i64,
        tv_nsec: (deadline_ns % SECOND_NS) as i64,
    };
    // The caller checks the clock and its stop flag after every sleep, interrupted or not.
    let _ended = clock_nanosleep_absolute(ClockId::Monotonic, &deadline);
}

#[allow(clippy::cast_sign_loss, reason = "the time since boot, or since 1970, is positive")]
fn nanoseconds(time: Timespec) -> u64 {
    time.tv_sec as u64 * SECOND_NS + time.tv_nsec as u64
}

/// The end of a wait, on the monotonic clock.
#[derive(Debug, Clone, Copy)]
pub struct Deadline {
    /// `None` if the deadline lies beyond the range of the clock.
    end: Option<Instant>,
}

impl Deadline {
    /// Returns the deadline `timeout` from now.
    #[allow(clippy::disallowed_methods, reason = "clocks are read here")]
    pub fn after(timeout: Duration) -> Self {
        Self { end: Instant::now().checked_add(timeout) }
    }

    /// Returns the time until the deadline; zero once it has passed.
    #[allow(clippy::disallowed_methods, reason = "clocks are read here")]
    pub fn remaining(self) -> Duration {
        self.end.map_or(Duration::MAX, |end| end.saturating_duration_since(Instant::now()))
    }
}

/// Time since a file was last written; zero if that lies in the future.
pub fn age(file: &Metadata) -> Duration {
    let written_ns =
        i128::from(file.mtime()) * i128::from(SECOND_NS) + i128::from(file.mtime_nsec());
    let age_ns = (i128::from(realtime_ns()) - written_ns).max(0);
    Duration::from_nanos(u64::try_from(age_ns).unwrap_or(u64::MAX))
}

/// Microseconds since the Unix epoch, below 2^53 until 2255.
pub fn epoch_microseconds() -> u64 {
    realtime_ns() / 1000
}
