//! Times of steps over the whole run and over the last second, and of their phases.

use anyhow::Context;
use hdrhistogram::Histogram;
use sim_host::clock::{SECOND_NS, monotonic_ns};

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

/// Part of the loop, in the order of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Commands are received, applied and answered.
    Drain,
    /// The solver computes the step.
    Solve,
    /// Messages are written, the particles last.
    Publish,
    /// Waiting readers are woken.
    Wake,
    /// The state is kept for rewinds.
    Keep,
    /// Late subscribers are served, and the status is published when it is due.
    Observe,
}

impl Phase {
    pub(crate) const ALL: [Self; 6] =
        [Self::Drain, Self::Solve, Self::Publish, Self::Wake, Self::Keep, Self::Observe];
}

/// Recorder of the times of phases, for `bench`. The default one is off, and does not read the clock.
#[derive(Debug, Default)]
pub(crate) struct Phases(Option<Box<Recorder>>);

#[derive(Debug)]
struct Recorder {
    times: PhaseTimes,
    /// Times of the current step, by phase.
    step_ns: [u64; Phase::ALL.len()],
    last_ns: u64,
}

/// Times of the phases of all recorded steps.
#[derive(Debug, Clone)]
pub(crate) struct PhaseTimes {
    /// By phase.
    pub(crate) phases: [Histogram<u64>; Phase::ALL.len()],
    /// The sum of all phases of a step except the solver's.
    pub(crate) outside_solver: Histogram<u64>,
}

impl PhaseTimes {
    pub(crate) fn new() -> anyhow::Result<Self> {
        let histogram: Histogram<u64> =
            Histogram::new_with_bounds(1, TIME_NS_MAX, 3).context("creating the histograms")?;
        Ok(Self { phases: Phase::ALL.map(|_| histogram.clone()), outside_solver: histogram })
    }
}

impl Phases {
    pub(crate) fn recording() -> anyhow::Result<Self> {
        let times = PhaseTimes::new()?;
        let recorder = Recorder { times, step_ns: [0; Phase::ALL.len()], last_ns: 0 };
        Ok(Self(Some(Box::new(recorder))))
    }

    pub(crate) fn times(&self) -> Option<&PhaseTimes> {
        self.0.as_ref().map(|recorder| &recorder.times)
    }

    /// Begins a step, at the end of its wait.
    pub(crate) fn begin(&mut self) {
        if let Some(recorder) = &mut self.0 {
            recorder.step_ns = [0; Phase::ALL.len()];
            recorder.last_ns = monotonic_ns();
        }
    }

    /// Ends a phase, which began with the end of the phase before.
    pub(crate) fn end(&mut self, phase: Phase) {
        if let Some(recorder) = &mut self.0 {
            recorder.end(phase, monotonic_ns());
        }
    }

    /// Records the phases since [`Self::begin`], if a step was among them.
    pub(crate) fn record(&mut self) {
        if let Some(recorder) = &mut self.0 {
            recorder.record();
        }
    }
}

impl Recorder {
    fn end(&mut self, phase: Phase, now_ns: u64) {
        self.step_ns[phase as usize] += now_ns - self.last_ns;
        self.last_ns = now_ns;
    }

    fn record(&mut self) {
        let solve_ns = self.step_ns[Phase::Solve as usize];
        if solve_ns == 0 {
            return;
        }
        for (histogram, time_ns) in self.times.phases.iter_mut().zip(self.step_ns) {
            histogram.saturating_record(time_ns);
        }
        let total_ns: u64 = self.step_ns.iter().sum();
        self.times.outside_solver.saturating_record(total_ns - solve_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_of_a_step_are_recorded_and_a_wait_without_a_step_is_not() {
        let mut phases = Phases::recording().unwrap();
        let recorder = phases.0.as_mut().unwrap();
        recorder.end(Phase::Drain, 7);
        recorder.record();
        recorder.step_ns = [0; Phase::ALL.len()];
        for (phase, now_ns) in
            [(Phase::Drain, 10), (Phase::Solve, 60), (Phase::Publish, 67), (Phase::Wake, 72)]
        {
            recorder.end(phase, now_ns);
        }
        recorder.end(Phase::Keep, 73);
        recorder.end(Phase::Observe, 75);
        recorder.record();
        let times = phases.times().unwrap();
        let recorded: Vec<_> = times.phases.iter().map(|one| (one.len(), one.max())).collect();
        assert_eq!(recorded, [(1, 3), (1, 50), (1, 7), (1, 5), (1, 1), (1, 2)]);
        assert_eq!((times.outside_solver.len(), times.outside_solver.max()), (1, 18));
    }
}
