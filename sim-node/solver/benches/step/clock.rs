//! The clock of the measurements, and what is made of many of them.

use rustix::time::{ClockId, clock_gettime};

/// CPU time of this process for some work, in ns: time that other processes take does not count.
pub(crate) fn cpu_ns(work: impl FnOnce()) -> f64 {
    between(ClockId::ProcessCPUTime, work)
}

/// Time on the wall for some work, in ns: the measure of work that is shared out.
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

/// The time that a tenth of them stay below.
pub(crate) fn tenth_percentile(times: Vec<f64>) -> f64 {
    after_share(10, times)
}

/// The first time behind the n-th part of the smaller ones.
fn after_share(n: usize, mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / n]
}

/// Says when whoever waits should hear that it goes on.
#[derive(Debug)]
pub(crate) struct Pacer {
    last_ns: f64,
}

/// Between two signs of life, in ns.
const PACE_NS: f64 = 10e9;

impl Pacer {
    pub(crate) fn new() -> Self {
        Self { last_ns: now(ClockId::Monotonic) }
    }

    /// Whether a while has passed since this was true.
    pub(crate) fn is_due(&mut self) -> bool {
        let now_ns = now(ClockId::Monotonic);
        let is_due = now_ns - self.last_ns >= PACE_NS;
        if is_due {
            self.last_ns = now_ns;
        }
        is_due
    }
}
