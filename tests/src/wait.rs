//! Polling for a condition, with a deadline.

use std::time::{Duration, Instant};

/// Limit on every wait. It is generous, because the machine may be busy.
pub const DEADLINE: Duration = Duration::from_mins(3);

/// A deadline for loops that may receive unrelated messages forever.
#[derive(Debug, Clone, Copy)]
pub struct Deadline {
    end: Instant,
}

impl Deadline {
    /// Starts a wait that ends [`DEADLINE`] from now.
    #[allow(clippy::disallowed_methods, reason = "the one clock of the tests")]
    pub fn start() -> Self {
        Self { end: Instant::now() + DEADLINE }
    }

    /// Checks the deadline.
    ///
    /// # Panics
    /// After the deadline, with a message that names `what`.
    #[allow(clippy::disallowed_methods, reason = "the one clock of the tests")]
    pub fn check(self, what: &str) {
        assert!(Instant::now() < self.end, "waited {DEADLINE:?} for {what}");
    }
}

/// Polls until the condition returns a value.
///
/// # Panics
/// After the deadline, with a message that names `what`.
#[allow(
    clippy::disallowed_methods,
    reason = "the one polling loop of the tests; it waits for a condition, not for a time"
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
