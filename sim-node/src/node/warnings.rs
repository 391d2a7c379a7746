//! Warnings and notes of a running node, limited so that no client can delay it by causing them.

use sim_contract::clock::{SECOND_NS, monotonic_ns};

use crate::output;

/// Most lines per second; further ones are only counted.
const LINES_PER_SECOND_MAX: u32 = 5;

/// Lines printed in the current second.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    second: u64,
    printed_count: u32,
    dropped_count: u64,
}

impl Warnings {
    /// Prints a warning on stderr, or counts it for the next one.
    pub(crate) fn print(&mut self, text: &str) {
        self.note(&format!("warning: {text}"));
    }

    /// Prints a line on stderr, or counts it for the next one.
    pub(crate) fn note(&mut self, text: &str) {
        let second = monotonic_ns() / SECOND_NS;
        if second != self.second {
            (self.second, self.printed_count) = (second, 0);
        }
        if self.printed_count == LINES_PER_SECOND_MAX {
            self.dropped_count += 1;
            return;
        }
        self.printed_count += 1;
        let dropped = match std::mem::take(&mut self.dropped_count) {
            0 => String::new(),
            count => format!(" ({count} more before this one)"),
        };
        output::note(&format!("{text}{dropped}"));
    }
}
