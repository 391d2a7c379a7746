//! Refusals of the system.

use std::fmt;

/// Reason why the system refuses a property, and the cure.
#[derive(Debug)]
pub(super) struct Refused {
    /// The property, such as "SCHED_FIFO".
    pub(super) property: &'static str,
    pub(super) reason: String,
    pub(super) cure: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "no {}: {}; {}", self.property, self.reason, self.cure)
    }
}
