//! Preparation of the thread of a loop: its timers, its scheduling, its CPU, and locked memory.

use std::num::NonZero;

use anyhow::bail;
use rustix::thread::set_current_timer_slack;

use super::cpus::Cpus;
use super::refused::Refused;
use super::{RealTime, RealTimeOptions, memory, scheduling};

/// Real-time properties of a thread, with a line for people about each one that was asked for.
#[derive(Debug, Default)]
pub(crate) struct Prepared {
    pub(crate) real_time: RealTime,
    pub(crate) lines: Vec<String>,
}

/// Obtains the real-time properties of the options for the calling thread.
///
/// # Errors
/// The system refuses a property that the options require.
pub(crate) fn prepare(options: RealTimeOptions, cpus: &mut Cpus) -> anyhow::Result<Prepared> {
    // The default of 50 µs, within which the system may delay a wake-up, would be most of the lateness.
    // Without the setting, the loop wakes later.
    let _kept = set_current_timer_slack(Some(NonZero::<u64>::MIN));
    let mut prepared = Prepared::default();
    if let Some(priority) = options.priority
        && prepared.obtain(options, scheduling::enter_fifo(priority))?
    {
        prepared.lines.push(format!("real time: SCHED_FIFO, priority {priority}"));
        prepared.real_time.fifo_priority = Some(priority);
    }
    let wanted = options.cpu.or_else(|| options.priority.and(cpus.last()));
    if let Some(cpu) = wanted
        && prepared.obtain(options, cpus.pin(cpu))?
    {
        prepared.lines.push(format!("real time: the loop runs on CPU {cpu}"));
        prepared.real_time.cpu = Some(cpu);
    }
    if options.priority.is_some() && prepared.obtain(options, memory::lock())? {
        prepared.lines.push("real time: memory is locked".to_owned());
        prepared.real_time.is_memory_locked = true;
    }
    Ok(prepared)
}

impl Prepared {
    /// Returns `true` if a property was obtained, and adds a warning if it was refused.
    fn obtain(
        &mut self,
        options: RealTimeOptions,
        result: Result<(), Refused>,
    ) -> anyhow::Result<bool> {
        let Err(refused) = result else { return Ok(true) };
        if options.is_required {
            bail!("--realtime=require: {refused}");
        }
        self.lines.push(format!("warning: real time: {refused}"));
        Ok(false)
    }
}
