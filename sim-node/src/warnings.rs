//! Warnings of a running node, of which no client can make so many that it stops for them.

use std::io::{Write, stderr};

use sim_contract::clock::{SECOND_NS, monotonic_ns};

/// Warnings in a second; those beyond it are counted.
const WARNINGS_PER_SECOND_MAX: u32 = 5;

/// What has been said lately.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    second: u64,
    said_count: u32,
    unsaid_count: u64,
}

impl Warnings {
    /// Writes a warning to stderr, or counts it for the next one.
    pub(crate) fn say(&mut self, text: &str) {
        let second = monotonic_ns() / SECOND_NS;
        if second != self.second {
            (self.second, self.said_count) = (second, 0);
        }
        if self.said_count == WARNINGS_PER_SECOND_MAX {
            self.unsaid_count += 1;
            return;
        }
        self.said_count += 1;
        let unsaid = match std::mem::take(&mut self.unsaid_count) {
            0 => String::new(),
            count => format!(" ({count} more before it)"),
        };
        // Whoever has closed stderr wants no warning.
        let _unheard = writeln!(stderr(), "warning: {text}{unsaid}");
    }
}
