//! Deadlines of steps: absolute, with a bounded policy for lateness.
//!
//! The node makes a late step at once and catches up with the following ones, without a longer dt.
//! A node more than [`CATCH_UP_NS_MAX`] behind gives up whole periods and counts them, so that a
//! stall (a suspended process) does not end in a burst of steps. A loop with real-time scheduling rests, and a node that makes
//! no step looks for commands in between.

use sim_host::clock::SECOND_NS;

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

/// Interval while clients send commands: a client that waits for an outcome sends the next one at once.
const BUSY_INTERVAL_NS: u64 = SECOND_NS / 50_000;
/// Time after the last command for which clients count as sending. It bounds the load of a node that
/// waits to a few milliseconds per command.
const BUSY_NS: u64 = SECOND_NS / 200;

/// Times of the looks for commands of a node that makes no step for now.
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

/// Time from one look at the processor time to the next.
const WINDOW_NS: u64 = SECOND_NS / 10;
/// Share of each window that the loop rests at least: one part in this number.
const REST_DIVISOR: u64 = 20;

/// Rests of a loop with real-time scheduling. A loop that cannot keep its pace has no time to sleep. With SCHED_FIFO, no
/// ordinary thread would then run on its core, and a machine with one core would freeze.
///
/// Holds the start of the current window; `None` before the first wait.
#[derive(Debug, Default)]
pub(crate) struct Rest(Option<Window>);

#[derive(Debug, Clone, Copy)]
struct Window {
    start_ns: u64,
    /// Processor time of the loop's thread at the start.
    busy_ns: u64,
}

impl Rest {
    /// Returns the end of a wait for a deadline: the deadline, or later if the loop has not rested.
    /// `busy_ns` reads the processor time of the loop's thread.
    pub(crate) fn end_ns(
        &mut self,
        now_ns: u64,
        deadline_ns: u64,
        busy_ns: impl Fn() -> u64,
    ) -> u64 {
        let window = self.0.get_or_insert_with(|| Window { start_ns: now_ns, busy_ns: busy_ns() });
        let elapsed_ns = now_ns - window.start_ns;
        if elapsed_ns < WINDOW_NS {
            return deadline_ns;
        }
        let total_ns = busy_ns();
        // The busy time is 19 of 20 parts of a window that is long enough.
        let needed_ns = (total_ns - window.busy_ns) / (REST_DIVISOR - 1) * REST_DIVISOR;
        let end_ns = deadline_ns.max(now_ns + needed_ns.saturating_sub(elapsed_ns));
        *window = Window { start_ns: end_ns.max(now_ns), busy_ns: total_ns };
        end_ns
    }
}

#[cfg(test)]
mod tests {
    //! Compares deadlines with exact fractions of a second.
    //! Runs loops of a given load on a clock of their own.
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

    /// Share of the time that a loop with steps of `step_ns` at a period of `period_ns` sleeps. It first
    /// sleeps for a minute without a deadline, as a paused node does.
    fn slept_share(step_ns: u64, period_ns: u64) -> f64 {
        let mut rest = Rest::default();
        rest.end_ns(0, 0, || 0);
        let start_ns = 60 * SECOND_NS;
        let (mut now_ns, mut deadline_ns, mut busy_ns) = (start_ns, start_ns, 0);
        while now_ns < start_ns + 10 * SECOND_NS {
            deadline_ns += period_ns;
            now_ns = rest.end_ns(now_ns, deadline_ns, || busy_ns).max(now_ns) + step_ns;
            busy_ns += step_ns;
        }
        1.0 - busy_ns as f64 / (now_ns - start_ns) as f64
    }

    #[test]
    fn an_overloaded_loop_rests_for_a_twentieth_of_the_time() {
        for (step_ns, period_ns) in [(1_000_000, 1_000_000), (900, 10), (300_000_000, 1_000_000)] {
            let share = slept_share(step_ns, period_ns);
            assert!((0.04..0.06).contains(&share), "{step_ns} of {period_ns}: {share}");
        }
    }

    #[test]
    fn a_loop_that_keeps_its_pace_gets_no_further_rest() {
        for (step_ns, share) in [(900_000, 0.1), (100_000, 0.9)] {
            let slept = slept_share(step_ns, 1_000_000);
            assert!((slept - share).abs() < 1e-3, "{slept} instead of {share}");
        }
    }
}
