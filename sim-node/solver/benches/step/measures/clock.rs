//! Clocks of the measurements, and their statistics.

use rustix::time::{ClockId, clock_gettime};

/// Returns the CPU time of this process for some work, in ns. Other processes do not count.
pub(crate) fn cpu_ns(work: impl FnOnce()) -> f64 {
    between(ClockId::ProcessCPUTime, work)
}

/// Returns the wall-clock time for some work, in ns. Use it for work on several threads.
pub(crate) fn wall_ns(work: impl FnOnce()) -> f64 {
    between(ClockId::Monotonic, work)
}

fn between(clock: ClockId, work: impl FnOnce()) -> f64 {
    let before = now(clock);
    work();
    now(clock) - before
}

fn now(clock: ClockId) -> f64 {
    let time = clock_gettime(clock);
    time.tv_sec as f64 * 1e9 + time.tv_nsec as f64
}

pub(crate) fn median(times: Vec<f64>) -> f64 {
    after_share(2, times)
}

/// Returns the time that a tenth of the measurements stay below.
pub(crate) fn tenth_percentile(times: Vec<f64>) -> f64 {
    after_share(10, times)
}

/// Returns the first time after the smallest n-th part of all.
fn after_share(n: usize, mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / n]
}

/// Decides when to print a sign of progress.
#[derive(Debug)]
pub(crate) struct Pacer {
    last_ns: f64,
}

/// Time between two signs of progress, in ns.
const PACE_NS: f64 = 10e9;

impl Pacer {
    pub(crate) fn new() -> Self {
        Self { last_ns: now(ClockId::Monotonic) }
    }

    /// Returns `true` once per interval.
    pub(crate) fn is_due(&mut self) -> bool {
        let now_ns = now(ClockId::Monotonic);
        let is_due = now_ns - self.last_ns >= PACE_NS;
        if is_due {
            self.last_ns = now_ns;
        }
        is_due
    }
}
