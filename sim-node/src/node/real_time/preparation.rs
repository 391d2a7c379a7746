//! Preparation of the loop for a run: its scheduling, its CPU, its memory, and the solver's threads.

use std::num::NonZero;

use anyhow::bail;
use rustix::thread::set_current_timer_slack;

use super::refused::Refused;
use super::rest::Rest;
use super::{RealTimeOptions, memory, scheduling};
use crate::node::Node;
use crate::node::threads::start_threads;
use crate::output;

impl Node {
    /// Starts the solver's threads and obtains the real-time properties of the options. Call it on the
    /// thread of the loop, after everything that takes long.
    ///
    /// # Errors
    /// The system refuses a property that the options require.
    pub(crate) fn prepare(&mut self) -> anyhow::Result<()> {
        // The default of 50 µs, within which the system may delay a wake-up, would be most of the
        // lateness. A system without the setting wakes the loop later.
        let _kept = set_current_timer_slack(Some(NonZero::<u64>::MIN));
        let options = self.options.real_time;
        if let Some(priority) = options.priority
            && obtain(options, scheduling::enter_fifo(priority))?
        {
            output::note(&format!("real time: SCHED_FIFO, priority {priority}"));
            self.real_time.fifo_priority = Some(priority);
            self.rest = Some(Rest::default());
        }
        let wanted = options.cpu.or_else(|| options.priority.and(self.cpus.last()));
        if let Some(cpu) = wanted
            && obtain(options, self.cpus.pin(cpu))?
        {
            output::note(&format!("real time: the loop runs on CPU {cpu}"));
            self.real_time.cpu = Some(cpu);
        }
        // They inherit the scheduling of this thread.
        start_threads(&mut self.solver, self.options.threads, &self.cpus);
        if options.priority.is_some() && obtain(options, memory::lock())? {
            output::note("real time: memory is locked");
            self.real_time.is_memory_locked = true;
        }
        Ok(())
    }
}

/// Returns `true` if a property was obtained, and reports a refusal.
fn obtain(options: RealTimeOptions, result: Result<(), Refused>) -> anyhow::Result<bool> {
    let Err(refused) = result else { return Ok(true) };
    if options.is_required {
        bail!("--realtime=require: {refused}");
    }
    output::note(&format!("warning: real time: {refused}"));
    Ok(false)
}
