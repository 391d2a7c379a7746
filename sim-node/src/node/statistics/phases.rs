//! Times of the phases of a step, for `bench`. Without it, the loop does not read the clock for them.

use anyhow::Context;
use hdrhistogram::Histogram;
use sim_contract::clock::monotonic_ns;

use super::TIME_NS_MAX;

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

/// Recorder of phases. The default one is off.
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
    /// The sum of all phases of a step, without that of the solver.
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
