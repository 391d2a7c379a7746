//! When the next step is due: absolute deadlines, with a bounded and stated policy for lateness.
//!
//! A late step is made at once and those after it catch up, without a longer dt. A node that is
//! more than [`CATCH_UP_NS_MAX`] behind gives up whole periods and counts them, so that a stall
//! (a suspended process) does not end in a burst.

use sim_contract::clock::SECOND_NS;

/// Most lateness that is caught up: a quarter of a second, or four periods if that is longer.
const CATCH_UP_NS_MAX: u64 = SECOND_NS / 4;

/// The deadlines of steps at a fixed rate.
#[derive(Debug, Clone)]
pub(crate) struct Pace {
    rate_hz: u64,
    /// CLOCK_MONOTONIC of the first deadline since the pace was (re)started.
    start_ns: u64,
    /// Deadlines met since then, that first one included.
    met: u64,
    /// Periods given up in the whole run.
    pub(crate) skipped_periods: u64,
}

impl Pace {
    pub(crate) fn new(rate_hz: u32, start_ns: u64) -> Self {
        Self { rate_hz: u64::from(rate_hz), start_ns, met: 1, skipped_periods: 0 }
    }

    /// Begins anew: `now_ns` is the deadline just met, the next one is a period later.
    pub(crate) fn restart(&mut self, now_ns: u64) {
        self.start_ns = now_ns;
        self.met = 1;
    }

    pub(crate) fn period_ns(&self) -> u64 {
        SECOND_NS / self.rate_hz
    }

    /// The next deadline: start + met / rate, never accumulated.
    pub(crate) fn deadline_ns(&self) -> u64 {
        // Seconds and the rest apart: exact, and without overflow for centuries.
        let (seconds, rest) = (self.met / self.rate_hz, self.met % self.rate_hz);
        self.start_ns + seconds * SECOND_NS + rest * SECOND_NS / self.rate_hz
    }

    /// Takes the next deadline as met at `now_ns`; returns how late that is.
    pub(crate) fn meet(&mut self, now_ns: u64) -> u64 {
        let late_ns = now_ns.saturating_sub(self.deadline_ns());
        self.met += 1;
        if late_ns > CATCH_UP_NS_MAX.max(4 * self.period_ns()) {
            let skipped = late_ns / self.period_ns();
            self.skipped_periods += skipped;
            self.start_ns += skipped * self.period_ns();
        }
        late_ns
    }
}

#[cfg(test)]
mod tests {
    //! Deadlines against exact fractions of a second.
    use super::*;

    #[test]
    fn deadlines_do_not_drift_at_rates_that_divide_no_second() {
        let mut pace = Pace::new(7, 100);
        for _ in 0..7 * 1_000_000 {
            let deadline_ns = pace.deadline_ns();
            assert_eq!(pace.meet(deadline_ns), 0);
        }
        assert_eq!(pace.deadline_ns(), 100 + 1_000_000 * SECOND_NS + SECOND_NS / 7);
    }

    #[test]
    fn a_late_step_moves_no_later_deadline() {
        let mut pace = Pace::new(1000, 0);
        assert_eq!(pace.meet(50_000_000), 49_000_000);
        assert_eq!(pace.deadline_ns(), 2_000_000);
        assert_eq!(pace.skipped_periods, 0);
    }

    #[test]
    fn a_stall_gives_periods_up_and_counts_them() {
        let mut pace = Pace::new(1000, 0);
        assert_eq!(pace.meet(3 * SECOND_NS), 2_999_000_000);
        assert_eq!(pace.skipped_periods, 2999);
        assert_eq!(pace.deadline_ns(), 3 * SECOND_NS + 1_000_000);
    }

    #[test]
    fn a_slow_rate_catches_up_a_few_periods() {
        let mut pace = Pace::new(1, 0);
        pace.meet(3 * SECOND_NS);
        assert_eq!((pace.skipped_periods, pace.deadline_ns()), (0, 2 * SECOND_NS));
    }
}
