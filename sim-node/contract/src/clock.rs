//! The only place of this crate that reads a clock.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The end of a wait, on the monotonic clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deadline {
    /// Absent: further away than the clock can tell.
    end: Option<Instant>,
}

impl Deadline {
    /// The deadline that is `timeout` from now.
    #[allow(clippy::disallowed_methods, reason = "clocks are read here")]
    pub(crate) fn after(timeout: Duration) -> Self {
        Self { end: Instant::now().checked_add(timeout) }
    }

    /// What is left until it; zero once it has passed.
    #[allow(clippy::disallowed_methods, reason = "clocks are read here")]
    pub(crate) fn remaining(self) -> Duration {
        self.end.map_or(Duration::MAX, |end| end.saturating_duration_since(Instant::now()))
    }
}

/// Microseconds since the Unix epoch; 0 if the clock stands before it. Below 2^53 until 2255.
#[allow(clippy::disallowed_methods, reason = "clocks are read here")]
pub(crate) fn epoch_microseconds() -> u64 {
    let elapsed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(elapsed.as_micros()).unwrap_or(u64::MAX)
}
