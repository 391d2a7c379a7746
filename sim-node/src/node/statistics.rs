//! Times of steps: over the whole run, and over the last second.

pub(crate) mod phases;

use anyhow::Context;
use hdrhistogram::Histogram;
use sim_contract::clock::SECOND_NS;

/// Longest time that the histograms resolve: a minute.
pub(crate) const TIME_NS_MAX: u64 = 60 * SECOND_NS;

/// Wake-up lateness and solver time of steps. Recording does not allocate.
#[derive(Debug)]
pub(crate) struct Times {
    wake_late: Histogram<u64>,
    solve: Histogram<u64>,
}

impl Times {
    fn new() -> anyhow::Result<Self> {
        // Three digits are enough for a percentile.
        let histogram =
            || Histogram::new_with_bounds(1, TIME_NS_MAX, 3).context("creating the histograms");
        Ok(Self { wake_late: histogram()?, solve: histogram()? })
    }

    fn record(&mut self, wake_late_ns: u64, solve_ns: u64) {
        self.wake_late.saturating_record(wake_late_ns);
        self.solve.saturating_record(solve_ns);
    }

    fn clear(&mut self) {
        self.wake_late.reset();
        self.solve.reset();
    }

    fn step_count(&self) -> u64 {
        self.solve.len()
    }

    pub(crate) fn wake_late(&self) -> &Histogram<u64> {
        &self.wake_late
    }

    pub(crate) fn wake_late_ns(&self, quantile: f64) -> u64 {
        self.wake_late.value_at_quantile(quantile)
    }

    pub(crate) fn solve_ns(&self, quantile: f64) -> u64 {
        self.solve.value_at_quantile(quantile)
    }
}

/// Percentiles of the times of a second.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SecondTimes {
    pub(crate) wake_late_ns_p50: u64,
    pub(crate) wake_late_ns_p99: u64,
    pub(crate) solve_ns_p50: u64,
    pub(crate) solve_ns_p99: u64,
}

impl SecondTimes {
    fn new(times: &Times) -> Self {
        Self {
            wake_late_ns_p50: times.wake_late_ns(0.5),
            wake_late_ns_p99: times.wake_late_ns(0.99),
            solve_ns_p50: times.solve_ns(0.5),
            solve_ns_p99: times.solve_ns(0.99),
        }
    }
}

/// Times and losses of a run.
#[derive(Debug)]
pub(crate) struct Statistics {
    pub(crate) run: Times,
    /// Times of the last whole second, computed once: a status follows each command.
    pub(crate) last: SecondTimes,
    current: Times,
    current_start_ns: u64,
    /// Simulated time per wall-clock time in the last whole second.
    pub(crate) real_time_factor: f64,
    /// Steps that began more than a period late.
    pub(crate) late_steps: u64,
    /// Periods skipped because the node was too far behind.
    pub(crate) skipped_periods: u64,
}

impl Statistics {
    pub(crate) fn new(now_ns: u64) -> anyhow::Result<Self> {
        Ok(Self {
            run: Times::new()?,
            last: SecondTimes::default(),
            current: Times::new()?,
            current_start_ns: now_ns,
            real_time_factor: 0.0,
            late_steps: 0,
            skipped_periods: 0,
        })
    }

    pub(crate) fn record(&mut self, wake_late_ns: u64, solve_ns: u64, period_ns: u64) {
        self.run.record(wake_late_ns, solve_ns);
        self.current.record(wake_late_ns, solve_ns);
        self.late_steps += u64::from(wake_late_ns > period_ns);
    }

    /// Makes the current second the last one, if it is over. Returns `true` if it was.
    pub(crate) fn end_second(&mut self, now_ns: u64, rate_hz: u32) -> bool {
        let elapsed_ns = now_ns - self.current_start_ns;
        if elapsed_ns < SECOND_NS {
            return false;
        }
        let simulated_s = self.current.step_count() as f64 / f64::from(rate_hz);
        self.last = SecondTimes::new(&self.current);
        self.current.clear();
        self.current_start_ns = now_ns;
        self.real_time_factor = simulated_s / (elapsed_ns as f64 / SECOND_NS as f64);
        true
    }
}
