//! The only place where this program reads or waits for a clock.

use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

/// Nanoseconds in a second.
pub(crate) const SECOND_NS: u64 = 1_000_000_000;

/// CLOCK_MONOTONIC in nanoseconds.
pub(crate) fn monotonic_ns() -> u64 {
    nanoseconds(clock_gettime(ClockId::Monotonic))
}

/// CLOCK_REALTIME in nanoseconds since 1970.
pub(crate) fn realtime_ns() -> u64 {
    nanoseconds(clock_gettime(ClockId::Realtime))
}

/// Sleeps until CLOCK_MONOTONIC reaches `deadline_ns`; a signal ends the sleep early. The deadline
/// is absolute, so that lateness does not add up over the steps.
pub(crate) fn sleep_until(deadline_ns: u64) {
    #[allow(clippy::cast_possible_wrap, reason = "centuries since boot fit into i64")]
    let deadline = Timespec {
        tv_sec: (deadline_ns / SECOND_NS) as i64,
        tv_nsec: (deadline_ns % SECOND_NS) as i64,
    };
    match clock_nanosleep_absolute(ClockId::Monotonic, &deadline) {
        // The caller looks at the stop flag, whatever ended the sleep; the arguments are valid.
        Ok(()) | Err(Errno::INTR | _) => {}
    }
}

#[allow(clippy::cast_sign_loss, reason = "the time since boot, or since 1970, is positive")]
fn nanoseconds(time: Timespec) -> u64 {
    time.tv_sec as u64 * SECOND_NS + time.tv_nsec as u64
}
