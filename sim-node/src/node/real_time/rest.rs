//! Rests of a loop with real-time scheduling.
//!
//! A loop that cannot keep its pace has no time to sleep. With SCHED_FIFO, no ordinary thread would then
//! run on its core, and a machine with one core would freeze.

use sim_contract::clock::SECOND_NS;

/// Time from one look at the processor time to the next.
const WINDOW_NS: u64 = SECOND_NS / 10;
/// Share of each window that the loop rests at least: one part in this number.
const REST_DIVISOR: u64 = 20;

/// Start of the current window; `None` before the first wait.
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
    //! Runs loops of a given load on a clock of their own.
    use super::*;

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
