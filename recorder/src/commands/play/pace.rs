//! The deadlines of snapshots.

/// Longest delay to catch up, in nanoseconds. After a longer one the replay continues from the
/// current time.
const CATCH_UP_MAX_NS: u64 = 200_000_000;

/// Maps recorded time to CLOCK_MONOTONIC. All times are in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    /// Recorded time per wall-clock time. Infinite where every snapshot is due at once.
    rate: f64,
    /// `None` before the first snapshot and after a pause.
    base: Option<Base>,
}

/// A recorded time and its deadline.
#[derive(Debug, Clone, Copy)]
struct Base {
    recorded_ns: u64,
    deadline_ns: u64,
}

impl Pace {
    pub(crate) fn new(rate: f64) -> Self {
        Self { rate, base: None }
    }

    /// Makes the next snapshot due at once.
    pub(crate) fn restart(&mut self) {
        self.base = None;
    }

    /// Changes the rate. The place in the recording stays the same.
    pub(crate) fn set_rate(&mut self, rate: f64, now_ns: u64) {
        if self.rate.is_infinite() {
            // Nothing was due at a time.
            self.restart();
        } else if let Some(base) = &mut self.base {
            let passed_ns = now_ns.saturating_sub(base.deadline_ns) as f64 * self.rate;
            base.recorded_ns = base.recorded_ns.saturating_add(whole_ns(passed_ns));
            base.deadline_ns = base.deadline_ns.max(now_ns);
        }
        self.rate = rate;
    }

    /// Returns the deadline of the snapshot at `recorded_ns`. The previous snapshot is published
    /// already.
    pub(crate) fn deadline_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let base = *self.base.get_or_insert(Base { recorded_ns, deadline_ns: now_ns });
        let passed_ns = recorded_ns.saturating_sub(base.recorded_ns) as f64 / self.rate;
        let deadline_ns = base.deadline_ns.saturating_add(whole_ns(passed_ns));
        if deadline_ns.saturating_add(CATCH_UP_MAX_NS) < now_ns {
            self.base = Some(Base { recorded_ns, deadline_ns: now_ns });
            return now_ns;
        }
        deadline_ns
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "positive, and saturating at the maximum"
)]
fn whole_ns(ns: f64) -> u64 {
    ns as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: u64 = 4_000_000;

    #[test]
    fn snapshots_are_due_at_the_recorded_intervals_divided_by_the_rate() {
        for (rate, expected_ns) in [(1.0, STEP_NS), (2.0, STEP_NS / 2), (0.5, STEP_NS * 2)] {
            let mut pace = Pace::new(rate);
            for step in 0..100 {
                let deadline_ns = pace.deadline_ns(77 + step * STEP_NS, 1000 + step * expected_ns);
                assert_eq!(deadline_ns, 1000 + step * expected_ns);
            }
        }
    }

    #[test]
    fn a_late_snapshot_does_not_delay_the_following_ones() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        assert_eq!(pace.deadline_ns(STEP_NS, STEP_NS * 3), STEP_NS);
        assert_eq!(pace.deadline_ns(STEP_NS * 4, STEP_NS * 3), STEP_NS * 4);
    }

    #[test]
    fn a_change_of_the_rate_keeps_the_place_in_the_recording() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        // Half of a step has passed. The other half takes twice its time.
        pace.set_rate(0.5, STEP_NS / 2);
        assert_eq!(pace.deadline_ns(STEP_NS, STEP_NS / 2), STEP_NS / 2 + STEP_NS);
        pace.set_rate(2.0, STEP_NS / 2 + STEP_NS);
        assert_eq!(pace.deadline_ns(STEP_NS * 3, STEP_NS * 2), STEP_NS / 2 + STEP_NS * 2);
    }

    #[test]
    fn without_a_limit_each_snapshot_is_due_at_once_until_a_rate_is_set() {
        let mut pace = Pace::new(f64::INFINITY);
        for step in 0..100 {
            assert!(pace.deadline_ns(step * STEP_NS, 1000 + step) <= 1000 + step);
        }
        pace.set_rate(1.0, 2000);
        assert_eq!(pace.deadline_ns(100 * STEP_NS, 2000), 2000);
        assert_eq!(pace.deadline_ns(101 * STEP_NS, 2000), 2000 + STEP_NS);
    }

    #[test]
    fn after_a_long_delay_the_replay_continues_from_the_current_time() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        let late_ns = CATCH_UP_MAX_NS * 2;
        assert_eq!(pace.deadline_ns(STEP_NS, late_ns), late_ns);
        assert_eq!(pace.deadline_ns(STEP_NS * 2, late_ns), late_ns + STEP_NS);
    }
}
