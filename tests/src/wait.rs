//! Waiting for a condition, with a deadline.

use std::time::{Duration, Instant};

/// Longest wait for anything that should happen at once: generous, because the machine may be busy.
pub const DEADLINE: Duration = Duration::from_mins(1);

/// The end of a wait in which other things than the awaited one may come for ever.
#[derive(Debug, Clone, Copy)]
pub struct Deadline {
    end: Instant,
}

impl Deadline {
    /// [`DEADLINE`] from now.
    #[allow(clippy::disallowed_methods, reason = "the one clock of the tests")]
    pub fn start() -> Self {
        Self { end: Instant::now() + DEADLINE }
    }

    /// # Panics
    /// At the end, naming what was waited for.
    #[allow(clippy::disallowed_methods, reason = "the one clock of the tests")]
    pub fn check(self, what: &str) {
        assert!(Instant::now() < self.end, "waited {DEADLINE:?} in vain for {what}");
    }
}

/// Polls until the condition gives a value.
///
/// # Panics
/// At the deadline, naming what was waited for.
#[allow(
    clippy::disallowed_methods,
    reason = "the one polling loop of the tests; what it waits for is a condition, not a time"
)]
pub fn wait_for<T>(what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let deadline = Deadline::start();
    loop {
        if let Some(value) = condition() {
            return value;
        }
        deadline.check(what);
        std::thread::sleep(Duration::from_millis(2));
    }
}
