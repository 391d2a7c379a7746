//! The scheduling policy of threads.

use std::io;

use rustix::process::{getpriority_process, setpriority_process};
use thread_priority::{
    Error, NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadPriority,
    ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

use super::refused::Refused;

/// Gives the calling thread the policy SCHED_FIFO: it runs before every ordinary thread. The threads
/// that it starts inherit that.
pub(super) fn enter_fifo(priority: u8) -> Result<(), Refused> {
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
