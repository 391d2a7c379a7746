//! Warnings and notes of a running node, limited so that no client can delay it by causing them.

use sim_host::clock::{SECOND_NS, monotonic_ns};

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
        if let Some(line) = self.line(text, monotonic_ns()) {
            output::note(&line);
        }
    }

    /// Prints how many lines were only counted, once their second is over.
    pub(crate) fn note_dropped(&mut self, now_ns: u64) {
        if let Some(line) = self.dropped_line(now_ns) {
            output::note(&line);
        }
    }

    /// Returns the line to print; `None` for a line that is only counted.
    fn line(&mut self, text: &str, now_ns: u64) -> Option<String> {
        let second = now_ns / SECOND_NS;
        if second != self.second {
            (self.second, self.printed_count) = (second, 0);
        }
        if self.printed_count == LINES_PER_SECOND_MAX {
            self.dropped_count += 1;
            return None;
        }
        self.printed_count += 1;
        let dropped = match std::mem::take(&mut self.dropped_count) {
            0 => String::new(),
            count => format!(" ({count} more before this one)"),
        };
        Some(format!("{text}{dropped}"))
    }

    fn dropped_line(&mut self, now_ns: u64) -> Option<String> {
        if self.dropped_count == 0 || now_ns / SECOND_NS == self.second {
            return None;
        }
        let count = std::mem::take(&mut self.dropped_count);
        let lines = if count == 1 { "line was" } else { "lines were" };
        Some(format!(
            "{count} more {lines} left out: at most {LINES_PER_SECOND_MAX} are printed in a second"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_beyond_the_limit_of_a_second_are_counted_without_another_line() {
        let mut warnings = Warnings::default();
        let lines: Vec<_> = (0..16).filter_map(|_| warnings.line("wrong", SECOND_NS)).collect();
        assert_eq!(lines, ["wrong"; 5]);
        assert_eq!(warnings.dropped_line(SECOND_NS), None, "the second goes on");
        let expected = "11 more lines were left out: at most 5 are printed in a second";
        assert_eq!(warnings.dropped_line(2 * SECOND_NS).as_deref(), Some(expected));
        assert_eq!(warnings.dropped_line(3 * SECOND_NS), None, "once");
        assert_eq!(warnings.line("wrong", 3 * SECOND_NS).as_deref(), Some("wrong"));
    }
}
