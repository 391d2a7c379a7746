//! Looks for commands of a node that makes no step for now.

use sim_contract::clock::SECOND_NS;

/// Interval while clients send commands: a client that waits for an outcome sends the next one at once.
const BUSY_INTERVAL_NS: u64 = SECOND_NS / 50_000;
/// Time after the last command for which clients count as sending. It bounds the load of a node that
/// waits to a few milliseconds per command.
const BUSY_NS: u64 = SECOND_NS / 200;

/// Times of the looks for commands.
#[derive(Debug, Default)]
pub(crate) struct Polling {
    /// CLOCK_MONOTONIC at which clients no longer count as sending.
    busy_until_ns: u64,
}

impl Polling {
    /// Notes that commands have arrived.
    pub(crate) fn on_commands(&mut self, now_ns: u64) {
        self.busy_until_ns = now_ns + BUSY_NS;
    }

    /// Returns the time of the next look, at most `interval_ns` from now.
    pub(crate) fn next_ns(&self, now_ns: u64, interval_ns: u64) -> u64 {
        let is_busy = now_ns < self.busy_until_ns;
        now_ns + if is_busy { BUSY_INTERVAL_NS.min(interval_ns) } else { interval_ns }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_shortens_the_interval_for_five_milliseconds() {
        let mut polling = Polling::default();
        assert_eq!(polling.next_ns(7, 2_000_000), 2_000_007);
        polling.on_commands(1000);
        assert_eq!(polling.next_ns(2000, 2_000_000), 22_000);
        assert_eq!(polling.next_ns(2000, 5), 2005);
        assert_eq!(polling.next_ns(5_000_999, 2_000_000), 5_020_999);
        assert_eq!(polling.next_ns(5_001_000, 2_000_000), 7_001_000);
    }
}
