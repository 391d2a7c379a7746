//! The clock of the measurements, and what is made of many of them.

use rustix::time::{ClockId, clock_gettime};

/// CPU time of this process for some work, in ns: time that other processes take does not count.
pub(crate) fn cpu_ns(work: impl FnOnce()) -> f64 {
    between(ClockId::ProcessCPUTime, work)
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

pub(crate) fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
