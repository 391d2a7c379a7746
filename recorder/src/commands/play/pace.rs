//! When a snapshot is due.

/// Lateness that is caught up, in nanoseconds. A replay that was held up for longer goes on from
/// where it is.
const CATCH_UP_MAX_NS: u64 = 200_000_000;

/// Maps recorded time to CLOCK_MONOTONIC. All times are in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    /// Recorded time per wall-clock time.
    rate: f64,
    /// A recorded time and the moment at which it was due; `None` before the first snapshot and
    /// after a pause.
    base: Option<(u64, u64)>,
}

impl Pace {
    pub(crate) fn new(rate: f64) -> Self {
        Self { rate, base: None }
    }

    /// Forgets the time: the next snapshot is due at once.
    pub(crate) fn restart(&mut self) {
        self.base = None;
    }

    /// When a snapshot of `recorded_ns` is due. It is asked for once the one before is published.
    pub(crate) fn deadline_ns(&mut self, recorded_ns: u64, now_ns: u64) -> u64 {
        let (base_recorded_ns, base_ns) = *self.base.get_or_insert((recorded_ns, now_ns));
        let passed_ns = recorded_ns.saturating_sub(base_recorded_ns) as f64 / self.rate;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and saturating at the far end of time"
        )]
        let deadline_ns = base_ns.saturating_add(passed_ns as u64);
        if deadline_ns.saturating_add(CATCH_UP_MAX_NS) < now_ns {
            self.base = Some((recorded_ns, now_ns));
            return now_ns;
        }
        deadline_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_NS: u64 = 4_000_000;

    #[test]
    fn snapshots_are_due_at_the_recorded_distances_divided_by_the_rate() {
        for (rate, expected_ns) in [(1.0, STEP_NS), (2.0, STEP_NS / 2), (0.5, STEP_NS * 2)] {
            let mut pace = Pace::new(rate);
            for step in 0..100 {
                let deadline_ns = pace.deadline_ns(77 + step * STEP_NS, 1000 + step * expected_ns);
                assert_eq!(deadline_ns, 1000 + step * expected_ns);
            }
        }
    }

    #[test]
    fn a_late_snapshot_does_not_move_those_behind_it() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        assert_eq!(pace.deadline_ns(STEP_NS, STEP_NS * 3), STEP_NS);
        assert_eq!(pace.deadline_ns(STEP_NS * 4, STEP_NS * 3), STEP_NS * 4);
    }

    #[test]
    fn after_a_long_hold_up_it_goes_on_from_there() {
        let mut pace = Pace::new(1.0);
        pace.deadline_ns(0, 0);
        let late_ns = CATCH_UP_MAX_NS * 2;
        assert_eq!(pace.deadline_ns(STEP_NS, late_ns), late_ns);
        assert_eq!(pace.deadline_ns(STEP_NS * 2, late_ns), late_ns + STEP_NS);
    }
}
