//! Waiting for a condition, with a deadline.

use std::time::{Duration, Instant};

/// Longest wait for anything that should happen at once: generous, because the machine may be busy.
pub const DEADLINE: Duration = Duration::from_mins(1);

/// Polls until the condition gives a value.
///
/// # Panics
/// At the deadline, naming what was waited for.
#[allow(
    clippy::disallowed_methods,
    reason = "the one polling loop of the tests; what it waits for is a condition, not a time"
)]
pub fn wait_for<T>(what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + DEADLINE;
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(Instant::now() < end, "waited {DEADLINE:?} in vain for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}
