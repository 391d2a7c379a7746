//! Real-time scheduling of the loop and of the solver's threads, a CPU for the loop, and locked memory.
//!
//! A run without them works, only with more lateness. So each property that the system refuses is reported
//! with its cure, and is an error only if the options require it.

use std::num::NonZero;
use std::thread::available_parallelism;
use std::{fmt, io};

use anyhow::bail;
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getpriority_process, getrlimit, setpriority_process};
use rustix::thread::{
    CapabilitySet, CpuSet, capabilities, sched_getaffinity, sched_setaffinity,
    set_current_timer_slack,
};
use serde::Serialize;
use thread_priority::{
    Error, NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
    ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

/// Options of real time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct RealTimeOptions {
    /// Priority of SCHED_FIFO, 1 to 99. `None` asks for no real-time scheduling and no locked memory.
    pub(crate) priority: Option<u8>,
    /// Makes a refusal of the system an error.
    pub(crate) is_required: bool,
    /// CPU that the loop runs on. With a priority, the default is the last allowed one.
    pub(crate) cpu: Option<usize>,
}

/// Real-time properties that a run has obtained.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct RealTime {
    /// Priority of SCHED_FIFO.
    pub(crate) fifo_priority: Option<u8>,
    /// CPU that the loop runs on.
    pub(crate) cpu: Option<usize>,
    pub(crate) is_memory_locked: bool,
}

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
        && prepared.obtain(options, enter_fifo(priority))?
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
    if options.priority.is_some() && prepared.obtain(options, lock_memory())? {
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

/// Gives the calling thread the policy SCHED_FIFO: it runs before every ordinary thread. The threads
/// that it starts inherit that.
fn enter_fifo(priority: u8) -> Result<(), Refused> {
    let refused = |reason| Refused {
        property: "SCHED_FIFO",
        reason,
        cure: format!(
            "allow it with `ulimit -r {priority}` (/etc/security/limits.d: `rtprio`), with `setcap \
             cap_sys_nice,cap_ipc_lock+ep` on this program, or in Docker with `--cap-add SYS_NICE \
             --ulimit rtprio=99`"
        ),
    };
    let value = priority.try_into().map_err(refused)?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let result = set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Crossplatform(value),
        fifo,
    );
    result.map_err(|error| refused(describe(&error)))
}

/// Gives the calling thread the ordinary policy, which a thread that works for seconds must have.
pub(crate) fn leave_fifo() {
    // The library sets a nice value with the policy, and the inherited one is restored. The lowest value
    // is the one that every thread may leave again; a thread that may not take it keeps its own.
    let nice = getpriority_process(None);
    let ordinary = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);
    let _policy = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Max, ordinary);
    if let Ok(nice) = nice {
        let _restored = setpriority_process(None, nice);
    }
}

fn describe(error: &Error) -> String {
    match error {
        Error::OS(code) => io::Error::from_raw_os_error(*code).to_string(),
        error => error.to_string(),
    }
}

/// The CPUs of this process, and the CPU of the loop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cpus {
    /// `None` if the system does not tell.
    allowed: Option<CpuSet>,
    /// Number of cores available to this process, which may be less than its CPUs.
    pub(crate) core_count: usize,
    of_loop: Option<usize>,
}

impl Cpus {
    /// Reads the CPUs of the calling thread, which is not pinned yet.
    pub(crate) fn observe() -> Self {
        Self {
            allowed: sched_getaffinity(None).ok(),
            // One core, if the system does not tell their number.
            core_count: available_parallelism().map_or(1, NonZero::get),
            of_loop: None,
        }
    }

    /// Returns `true` if this process may use a CPU.
    pub(crate) fn is_allowed(&self, cpu: usize) -> bool {
        cpu < CpuSet::MAX_CPU && self.allowed.is_some_and(|allowed| allowed.is_set(cpu))
    }

    /// Returns the last CPU: the first ones handle most interrupts.
    pub(crate) fn last(&self) -> Option<usize> {
        (0..CpuSet::MAX_CPU).rev().find(|cpu| self.is_allowed(*cpu))
    }

    /// Returns the allowed CPUs as text, such as "0-3, 6".
    pub(crate) fn text(&self) -> String {
        let allowed: Vec<_> = (0..CpuSet::MAX_CPU).filter(|cpu| self.is_allowed(*cpu)).collect();
        let ranges = allowed.chunk_by(|before, cpu| before + 1 == *cpu);
        let range = |cpus: &[usize]| match cpus {
            [first, .., last] => format!("{first}-{last}"),
            _ => cpus[0].to_string(),
        };
        ranges.map(range).collect::<Vec<_>>().join(", ")
    }

    /// Makes the calling thread, which runs the loop, run on one CPU.
    fn pin(&mut self, cpu: usize) -> Result<(), Refused> {
        let mut set = CpuSet::new();
        set.set(cpu);
        sched_setaffinity(None, &set).map_err(|error| Refused {
            property: "CPU for the loop",
            reason: format!("CPU {cpu}: {error}"),
            cure: format!("choose one with `--cpu` (allowed: {})", self.text()),
        })?;
        self.of_loop = Some(cpu);
        Ok(())
    }

    /// Calls a function on the thread of the loop that starts threads. They inherit the CPUs of this
    /// thread, so meanwhile it may use those that the loop leaves, or its own one if there is no other.
    pub(crate) fn lend<T>(&self, start: impl FnOnce() -> T) -> T {
        let (Some(mut others), Some(cpu)) = (self.allowed, self.of_loop) else { return start() };
        others.unset(cpu);
        let has_lent = others.count() > 0 && sched_setaffinity(None, &others).is_ok();
        let started = start();
        if has_lent {
            let mut own = CpuSet::new();
            own.set(cpu);
            // The CPU was allowed before. If it has gone since, the loop continues on the others.
            let _kept = sched_setaffinity(None, &own);
        }
        started
    }
}

/// Locks the memory of the process, and all that it will touch.
///
/// Without `ONFAULT`, the system would fill every page of the shared memory, which is sized for sixteen
/// slow readers.
fn lock_memory() -> Result<(), Refused> {
    let refused = |reason| Refused { property: "locked memory", reason, cure: memory_cure() };
    // Under a limit, later allocations would fail, such as the memory of a load.
    if let Some(limit_bytes) = limit_bytes() {
        let text = format!("this process may lock {} KiB only", limit_bytes >> 10);
        return Err(refused(text));
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT)
        .map_err(|error| refused(error.to_string()))
}

/// Returns the limit on locked memory, which does not concern a privileged process.
fn limit_bytes() -> Option<u64> {
    let is_privileged = capabilities(None)
        .is_ok_and(|capabilities| capabilities.effective.contains(CapabilitySet::IPC_LOCK));
    if is_privileged { None } else { getrlimit(Resource::Memlock).current }
}

fn memory_cure() -> String {
    "allow it with `ulimit -l unlimited` (/etc/security/limits.d: `memlock`), with `setcap \
     cap_sys_nice,cap_ipc_lock+ep` on this program, or in Docker with `--ulimit memlock=-1`"
        .to_owned()
}

/// Reason why the system refuses a property, and the cure.
#[derive(Debug)]
struct Refused {
    /// The property, such as "SCHED_FIFO".
    property: &'static str,
    reason: String,
    cure: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "no {}: {}; {}", self.property, self.reason, self.cure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cpus(allowed: &[usize]) -> Cpus {
        let mut set = CpuSet::new();
        for cpu in allowed {
            set.set(*cpu);
        }
        Cpus { allowed: Some(set), core_count: allowed.len(), of_loop: None }
    }

    #[test]
    fn allowed_cpus_are_listed_as_ranges() {
        for (allowed, text) in [
            (&[0][..], "0"),
            (&[0, 1], "0-1"),
            (&[0, 1, 2, 5, 7, 8, 1023], "0-2, 5, 7-8, 1023"),
            (&[], ""),
        ] {
            assert_eq!(cpus(allowed).text(), text);
        }
    }

    #[test]
    fn the_last_allowed_cpu_is_found_and_none_beyond_the_set_is_allowed() {
        let some = cpus(&[0, 3, 6]);
        assert_eq!(some.last(), Some(6));
        assert!(some.is_allowed(3) && !some.is_allowed(4));
        assert!(!some.is_allowed(CpuSet::MAX_CPU) && !some.is_allowed(usize::MAX));
        assert_eq!(cpus(&[]).last(), None);
    }
}
