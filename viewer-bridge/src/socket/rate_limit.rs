//! Limit on the number of messages that a client sends.

use sim_contract::clock::SECOND_NS;

use crate::limits::{MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX};

/// Counts the messages of one client: a burst, then a steady rate (token bucket).
#[derive(Debug)]
pub(super) struct RateLimit {
    /// Messages that the client can send now.
    allowance: f64,
    last_ns: u64,
}

impl RateLimit {
    pub(super) fn new(now_ns: u64) -> Self {
        Self { allowance: f64::from(MESSAGES_BURST_MAX), last_ns: now_ns }
    }

    /// Counts a message. Returns whether it is within the limit.
    pub(super) fn allows(&mut self, now_ns: u64) -> bool {
        let elapsed_s = now_ns.saturating_sub(self.last_ns) as f64 / SECOND_NS as f64;
        self.last_ns = now_ns;
        self.allowance = (self.allowance + elapsed_s * f64::from(MESSAGES_PER_SECOND_MAX))
            .min(f64::from(MESSAGES_BURST_MAX));
        self.allowance -= 1.0;
        self.allowance >= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_and_then_the_steady_rate() {
        let mut limit = RateLimit::new(0);
        assert!((0..MESSAGES_BURST_MAX).all(|_| limit.allows(0)));
        assert!(!limit.allows(0));
        let mut limit = RateLimit::new(0);
        let period_ns = SECOND_NS / u64::from(MESSAGES_PER_SECOND_MAX) + 1;
        assert!((1..5000).all(|number| limit.allows(number * period_ns)));
    }
}
