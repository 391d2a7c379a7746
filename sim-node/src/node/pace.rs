//! Deadlines of steps: absolute, with a bounded policy for lateness.
//!
//! The node makes a late step at once and catches up with the following ones, without a longer dt.
//! A node more than [`CATCH_UP_NS_MAX`] behind gives up whole periods and counts them, so that a
//! stall (a suspended process) does not end in a burst of steps.

pub(crate) mod polling;

use sim_contract::clock::SECOND_NS;

/// Most lateness that the node catches up: a quarter of a second, or four periods if that is longer.
const CATCH_UP_NS_MAX: u64 = SECOND_NS / 4;

/// Deadlines of steps at a fixed rate.
#[derive(Debug, Clone)]
pub(crate) struct Pace {
    rate_hz: u64,
    /// Simulated time per wall-clock time.
    time_scale: f64,
    /// CLOCK_MONOTONIC at which the pace began or last changed.
    start_ns: u64,
    /// Simulated time between the last deadline met before `start_ns` and `start_ns`.
    start_offset_ns: u64,
    /// Periods from that deadline to the next one, at least 1.
    period_count: u64,
    /// Periods given up in the whole run.
    pub(crate) skipped_periods: u64,
}

impl Pace {
    /// Counts `start_ns` as a deadline just met; the next one is a period later.
    pub(crate) fn new(rate_hz: u32, start_ns: u64) -> Self {
        Self {
            rate_hz: u64::from(rate_hz),
            time_scale: 1.0,
            start_ns,
            start_offset_ns: 0,
            period_count: 1,
            skipped_periods: 0,
        }
    }

    /// Begins again: `now_ns` is the deadline just met, and the next one is a period later.
    pub(crate) fn restart(&mut self, now_ns: u64) {
        self.start_ns = now_ns;
        self.start_offset_ns = 0;
        self.period_count = 1;
    }

    /// Continues at another pace from `now_ns`. What remains of the current period is scaled, so a
    /// change while the node waits moves the deadline it waits for. Lateness is neither lost nor
    /// scaled.
    pub(crate) fn set_time_scale(&mut self, time_scale: f64, now_ns: u64) {
        if time_scale.to_bits() == self.time_scale.to_bits() {
            return;
        }
        let last_ns = self.start_ns + self.scaled(self.time_to_ns(self.period_count - 1));
        let next_ns = self.deadline_ns();
        let now_ns = now_ns.clamp(last_ns, next_ns);
        let remaining_ns = self.simulated(next_ns - now_ns);
        self.start_ns = now_ns;
        self.period_count = 1;
        self.start_offset_ns = (SECOND_NS / self.rate_hz).saturating_sub(remaining_ns);
        self.time_scale = time_scale;
    }

    /// Wall-clock time from one deadline to the next.
    pub(crate) fn period_ns(&self) -> u64 {
        self.scaled(SECOND_NS / self.rate_hz).max(1)
    }

    /// CLOCK_MONOTONIC of the next deadline, computed from the start and never accumulated.
    pub(crate) fn deadline_ns(&self) -> u64 {
        self.start_ns + self.scaled(self.time_to_ns(self.period_count))
    }

    /// Simulated time from the start to the deadline after `period_count` periods.
    fn time_to_ns(&self, period_count: u64) -> u64 {
        // Whole seconds apart from the rest: exact, and without overflow for centuries.
        let (seconds, rest) = (period_count / self.rate_hz, period_count % self.rate_hz);
        let time_ns = seconds * SECOND_NS + rest * SECOND_NS / self.rate_hz;
        time_ns.saturating_sub(self.start_offset_ns)
    }

    /// Wall-clock time that the simulated `time_ns` takes; in f64, exact to 104 days.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive time, at most a thousand times the simulated one"
    )]
    fn scaled(&self, time_ns: u64) -> u64 {
        // Real time stays exact for any length.
        if self.time_scale.to_bits() == 1.0_f64.to_bits() {
            return time_ns;
        }
        (time_ns as f64 / self.time_scale) as u64
    }

    /// Simulated time in a wall-clock time of at most a period.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive time of at most a period"
    )]
    fn simulated(&self, time_ns: u64) -> u64 {
        (time_ns as f64 * self.time_scale).round() as u64
    }

    /// Counts the next deadline as met at `now_ns` and returns how late that is.
    pub(crate) fn meet(&mut self, now_ns: u64) -> u64 {
        let late_ns = now_ns.saturating_sub(self.deadline_ns());
        self.period_count += 1;
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
    //! Compares deadlines with exact fractions of a second.
    use super::*;

    #[test]
    fn a_pace_changed_at_a_deadline_counts_from_that_deadline() {
        let mut pace = Pace::new(100, 1000);
        for _ in 0..5 {
            pace.meet(pace.deadline_ns());
        }
        // 50 ms have passed; at a tenth of real time, a period takes 100 ms.
        pace.set_time_scale(0.1, 1000 + 50_000_000);
        assert_eq!((pace.deadline_ns(), pace.period_ns()), (1000 + 150_000_000, 100_000_000));
        pace.meet(pace.deadline_ns());
        pace.set_time_scale(1.0, 1000 + 150_000_000);
        assert_eq!(pace.deadline_ns(), 1000 + 160_000_000);
    }

    #[test]
    fn a_pace_changed_within_a_period_scales_the_rest_of_it() {
        let mut pace = Pace::new(100, 0);
        pace.set_time_scale(0.001, 0);
        assert_eq!(pace.deadline_ns(), 10 * SECOND_NS);
        // 4 of 10 s have passed: 6 ms of simulated time remain.
        pace.set_time_scale(1.0, 4 * SECOND_NS);
        assert_eq!(pace.deadline_ns(), 4 * SECOND_NS + 6_000_000);
        pace.set_time_scale(0.1, 4 * SECOND_NS + 1_000_000);
        assert_eq!(pace.deadline_ns(), 4 * SECOND_NS + 51_000_000);
        assert_eq!(pace.meet(pace.deadline_ns()), 0);
        assert_eq!(pace.deadline_ns(), 4 * SECOND_NS + 151_000_000);
        assert_eq!(pace.skipped_periods, 0);
    }

    #[test]
    fn a_change_of_pace_keeps_the_lateness_of_a_late_step() {
        let mut pace = Pace::new(100, 0);
        pace.meet(10_000_000);
        // The deadline of the next step, 20 ms, passed 5 ms ago.
        pace.set_time_scale(0.5, 25_000_000);
        assert_eq!(pace.meet(25_000_000), 5_000_000);
        assert_eq!(pace.deadline_ns(), 40_000_000);
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
