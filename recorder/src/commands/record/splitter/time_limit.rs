//! The end of a recording after a time.

use std::time::Duration;

use sim_contract::SnapshotHeader;
use sim_contract::clock::SECOND_NS;

/// Longest time that a node is behind its pace before it gives up steps.
const BEHIND_NS: u64 = SECOND_NS / 4;

/// A limit on the time of a recording. It counts from the first recorded step, and until there is one, from the
/// start.
///
/// A node that is late by less than a quarter of a second makes up for it, so the limit waits that long for the
/// steps of its time. A node that is paused or slowed never makes them in time.
#[derive(Debug)]
pub(crate) struct TimeLimit {
    duration: Duration,
    /// CLOCK_MONOTONIC at the first recorded step, or at the start.
    begin_ns: u64,
    first: Option<FirstStep>,
}

/// The first recorded step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstStep {
    pub(crate) run_id: u64,
    pub(crate) step: u64,
    pub(crate) rate_hz: u32,
    pub(crate) publish_monotonic_ns: u64,
}

impl TimeLimit {
    pub(crate) fn new(duration: Duration, now_ns: u64) -> Self {
        Self { duration, begin_ns: now_ns, first: None }
    }

    /// Counts from the publication of this step on, unless another one came before: the step may have waited
    /// for its reader. The bound is for the clock of another host.
    pub(crate) fn begin(&mut self, first: FirstStep, now_ns: u64) {
        if self.first.is_none() {
            let earliest_ns = now_ns.saturating_sub(BEHIND_NS);
            self.begin_ns = first.publish_monotonic_ns.clamp(earliest_ns, now_ns);
            self.first = Some(first);
        }
    }

    /// Returns `true` if the recording ends, where `last` is the last recorded state.
    pub(crate) fn is_reached(&self, last: Option<&SnapshotHeader>, now_ns: u64) -> bool {
        let passed = Duration::from_nanos(now_ns.saturating_sub(self.begin_ns));
        let Some(over) = passed.checked_sub(self.duration) else { return false };
        match (&self.first, last) {
            (Some(first), Some(last)) => {
                first.has_steps_of(self.duration, last) || over >= first.wait(last)
            }
            _ => true,
        }
    }
}

impl FirstStep {
    /// Returns `true` if the steps of a time have been made by the last one. Another run has its own steps.
    fn has_steps_of(&self, duration: Duration, last: &SnapshotHeader) -> bool {
        let steps = last.step.saturating_sub(self.step);
        let needed = duration.as_nanos() * u128::from(self.rate_hz);
        last.run_id != self.run_id || u128::from(steps) * u128::from(SECOND_NS) >= needed
    }

    /// Longest wait for the last steps: that for the next snapshot, and that for a late one.
    fn wait(&self, last: &SnapshotHeader) -> Duration {
        let period_ns = u64::from(last.stride) * SECOND_NS / u64::from(self.rate_hz.max(1));
        Duration::from_nanos(period_ns + BEHIND_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DURATION: Duration = Duration::from_secs(5);
    const BEGIN_NS: u64 = SECOND_NS / 10;
    const FIRST: FirstStep =
        FirstStep { run_id: 7, step: 100, rate_hz: 240, publish_monotonic_ns: BEGIN_NS };
    const END_NS: u64 = BEGIN_NS + 5 * SECOND_NS;

    fn at(step: u64) -> SnapshotHeader {
        SnapshotHeader { run_id: 7, step, stride: 1, ..SnapshotHeader::default() }
    }

    fn begun() -> TimeLimit {
        let mut limit = TimeLimit::new(DURATION, 0);
        limit.begin(FIRST, BEGIN_NS);
        limit
    }

    #[test]
    fn the_time_counts_from_the_first_recorded_step() {
        let limit = begun();
        assert!(!limit.is_reached(Some(&at(1300)), END_NS - 1));
        assert!(limit.is_reached(Some(&at(1300)), END_NS));
        let mut later_file = begun();
        later_file.begin(FirstStep { step: 900, ..FIRST }, BEGIN_NS + 3 * SECOND_NS);
        assert!(
            later_file.is_reached(Some(&at(1300)), END_NS),
            "a later file counts from the first"
        );
    }

    #[test]
    fn the_wait_of_the_first_step_for_the_recorder_makes_no_recording_longer() {
        let read_at = |now_ns| {
            let mut limit = TimeLimit::new(DURATION, 0);
            limit.begin(FIRST, now_ns);
            limit
        };
        let late = read_at(BEGIN_NS + SECOND_NS / 5);
        assert!(late.is_reached(Some(&at(1300)), END_NS));
        assert!(!late.is_reached(Some(&at(1299)), END_NS));
        // The clock of another host.
        let now_ns = 1000 * SECOND_NS;
        let other = read_at(now_ns);
        assert!(!other.is_reached(Some(&at(1299)), now_ns + 5 * SECOND_NS));
        assert!(other.is_reached(Some(&at(1300)), now_ns + 5 * SECOND_NS));
    }

    #[test]
    fn without_a_step_the_time_counts_from_the_start() {
        let limit = TimeLimit::new(DURATION, 0);
        assert!(
            !limit.is_reached(None, 5 * SECOND_NS - 1) && limit.is_reached(None, 5 * SECOND_NS)
        );
    }

    #[test]
    fn the_last_steps_of_a_late_node_are_awaited_and_those_of_a_slow_one_are_not() {
        let limit = begun();
        // Step 1300 is 5 s after step 100.
        assert!(!limit.is_reached(Some(&at(1299)), END_NS + BEHIND_NS));
        assert!(limit.is_reached(Some(&at(1300)), END_NS + 1));
        let period_ns = SECOND_NS / 240;
        assert!(limit.is_reached(Some(&at(100)), END_NS + BEHIND_NS + period_ns));
        // With a snapshot each second, the one at step 1300 may come a second later.
        let sparse = SnapshotHeader { stride: 240, ..at(1060) };
        assert!(!limit.is_reached(Some(&sparse), END_NS + SECOND_NS));
    }

    #[test]
    fn the_steps_of_another_run_are_not_counted() {
        let other = SnapshotHeader { run_id: 8, ..at(3) };
        assert!(begun().is_reached(Some(&other), END_NS));
    }
}
