//! How many messages a page may send.

use sim_contract::clock::SECOND_NS;

use crate::limits::{MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX};

/// Counts the messages of one page: so many at once, and then so many a second.
#[derive(Debug)]
pub(crate) struct RateLimit {
    /// Messages that may come now.
    allowance: f64,
    last_ns: u64,
}

impl RateLimit {
    pub(crate) fn new(now_ns: u64) -> Self {
        Self { allowance: f64::from(MESSAGES_BURST_MAX), last_ns: now_ns }
    }

    /// Counts a message; whether it was within the limit.
    pub(crate) fn allows(&mut self, now_ns: u64) -> bool {
        let passed_s = now_ns.saturating_sub(self.last_ns) as f64 / SECOND_NS as f64;
        self.last_ns = now_ns;
        self.allowance = (self.allowance + passed_s * f64::from(MESSAGES_PER_SECOND_MAX))
            .min(f64::from(MESSAGES_BURST_MAX));
        self.allowance -= 1.0;
        self.allowance >= 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_and_then_the_rate() {
        let mut limit = RateLimit::new(0);
        assert!((0..MESSAGES_BURST_MAX).all(|_| limit.allows(0)));
        assert!(!limit.allows(0));
        let mut limit = RateLimit::new(0);
        let period_ns = SECOND_NS / u64::from(MESSAGES_PER_SECOND_MAX) + 1;
        assert!((1..5000).all(|number| limit.allows(number * period_ns)));
    }
}
