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
    /// Simulated time per wall-clock time.
    time_scale: f64,
    /// CLOCK_MONOTONIC of the first deadline since the pace was (re)started.
    start_ns: u64,
    /// Deadlines met since then, that first one included.
    met: u64,
    /// Periods given up in the whole run.
    pub(crate) skipped_periods: u64,
}

impl Pace {
    pub(crate) fn new(rate_hz: u32, start_ns: u64) -> Self {
        Self { rate_hz: u64::from(rate_hz), time_scale: 1.0, start_ns, met: 1, skipped_periods: 0 }
    }

    /// Begins anew: `now_ns` is the deadline just met, the next one is a period later.
    pub(crate) fn restart(&mut self, now_ns: u64) {
        self.start_ns = now_ns;
        self.met = 1;
    }

    /// Goes on at another pace: the last deadline met is where it begins.
    pub(crate) fn set_time_scale(&mut self, time_scale: f64) {
        if time_scale.to_bits() == self.time_scale.to_bits() {
            return;
        }
        self.met -= 1;
        self.start_ns = self.deadline_ns();
        self.met = 1;
        self.time_scale = time_scale;
    }

    pub(crate) fn period_ns(&self) -> u64 {
        self.scaled(SECOND_NS / self.rate_hz).max(1)
    }

    /// The next deadline: start + met / rate, never accumulated.
    pub(crate) fn deadline_ns(&self) -> u64 {
        // Seconds and the rest apart: exact, and without overflow for centuries.
        let (seconds, rest) = (self.met / self.rate_hz, self.met % self.rate_hz);
        self.start_ns + self.scaled(seconds * SECOND_NS + rest * SECOND_NS / self.rate_hz)
    }

    /// Simulated nanoseconds as those of the wall; in f64 exact to 104 days.
    fn scaled(&self, time_ns: u64) -> u64 {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a time of the wall, at most a thousand times the simulated one"
        )]
        let scaled = (time_ns as f64 / self.time_scale) as u64;
        // Exact for ever where it is real time.
        if self.time_scale.to_bits() == 1.0_f64.to_bits() { time_ns } else { scaled }
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
    fn another_pace_goes_on_from_the_last_deadline() {
        let mut pace = Pace::new(100, 1000);
        for _ in 0..5 {
            pace.meet(pace.deadline_ns());
        }
        // 50 ms have passed; at a tenth of real time, a period takes 100 ms.
        pace.set_time_scale(0.1);
        assert_eq!((pace.deadline_ns(), pace.period_ns()), (1000 + 150_000_000, 100_000_000));
        pace.meet(pace.deadline_ns());
        pace.set_time_scale(1.0);
        assert_eq!(pace.deadline_ns(), 1000 + 160_000_000);
    }

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
