//! Limit on the rate of something that a client sends.

use std::time::Duration;

use sim_contract::clock::SECOND_NS;

/// A burst, then a steady rate (token bucket).
#[derive(Debug, Clone, Copy)]
pub(super) struct Rate {
    pub(super) per_second: u32,
    pub(super) burst: u32,
}

/// Counts what one client sends.
#[derive(Debug)]
pub(super) struct RateLimit {
    rate: Rate,
    /// Amount that the client can send now. Negative after more than that.
    allowance: f64,
    last_ns: u64,
}

impl RateLimit {
    pub(super) fn new(rate: Rate, now_ns: u64) -> Self {
        Self { rate, allowance: f64::from(rate.burst), last_ns: now_ns }
    }

    /// Counts an amount. Returns the time until the client is within the limit again: 0 if it is now.
    pub(super) fn count(&mut self, amount: usize, now_ns: u64) -> Duration {
        let per_second = f64::from(self.rate.per_second);
        let elapsed_s = now_ns.saturating_sub(self.last_ns) as f64 / SECOND_NS as f64;
        self.last_ns = now_ns;
        self.allowance = (self.allowance + elapsed_s * per_second).min(f64::from(self.rate.burst));
        self.allowance -= amount as f64;
        Duration::from_secs_f64((-self.allowance).max(0.0) / per_second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: Rate = Rate { per_second: 240, burst: 480 };

    #[test]
    fn a_burst_passes_and_then_the_steady_rate() {
        let mut limit = RateLimit::new(RATE, 0);
        assert!((0..RATE.burst).all(|_| limit.count(1, 0).is_zero()));
        assert!(!limit.count(1, 0).is_zero());
        let mut limit = RateLimit::new(RATE, 0);
        let period_ns = SECOND_NS / u64::from(RATE.per_second) + 1;
        assert!((1..5000).all(|number| limit.count(1, number * period_ns).is_zero()));
    }

    #[test]
    fn the_wait_is_as_long_as_the_rate_takes_for_the_excess() {
        let mut limit = RateLimit::new(RATE, 0);
        assert_eq!(limit.count(960, 0), Duration::from_secs(2));
        assert_eq!(limit.count(0, SECOND_NS), Duration::from_secs(1));
        assert_eq!(limit.count(0, 2 * SECOND_NS), Duration::ZERO);
    }
}
