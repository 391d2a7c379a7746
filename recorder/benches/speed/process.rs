//! A process and the times that it takes.

use std::fs;
use std::process::{Child, Command, Stdio};

use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
use sim_host::clock::monotonic_ns;

/// Times of `/proc` are multiples of this on every Linux of x86-64, in seconds.
const TICK_S: f64 = 0.01;

/// The program to measure.
pub(crate) const RECORDER: &str = env!("CARGO_BIN_EXE_recorder");

/// The times of a process from its start to its end, in seconds.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_field_names, reason = "the unit is part of the name")]
pub(crate) struct Times {
    pub(crate) wall_s: f64,
    pub(crate) user_s: f64,
    pub(crate) system_s: f64,
    pub(crate) main_thread_s: f64,
}

impl Times {
    /// Longer than those of any process.
    pub(crate) const MAX: Self = Self {
        wall_s: f64::INFINITY,
        user_s: f64::INFINITY,
        system_s: f64::INFINITY,
        main_thread_s: f64::INFINITY,
    };

    pub(crate) fn cpu_s(self) -> f64 {
        self.user_s + self.system_s
    }

    /// Keeps the round with less CPU time, and the shorter wall-clock time and time of the main thread.
    pub(crate) fn best(self, other: Self) -> Self {
        let round = if other.cpu_s() < self.cpu_s() { other } else { self };
        Self {
            wall_s: self.wall_s.min(other.wall_s),
            main_thread_s: self.main_thread_s.min(other.main_thread_s),
            ..round
        }
    }
}

/// Starts a process without output. `errors` receives its messages.
#[allow(clippy::disallowed_methods, reason = "a benchmark starts the programs that it measures")]
pub(crate) fn start(program: &str, arguments: &[&str], errors: Stdio) -> Child {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors);
    command.spawn().unwrap()
}

/// Runs a process to its end. It must succeed.
pub(crate) fn measure(program: &str, arguments: &[&str]) -> Times {
    let begin_ns = monotonic_ns();
    let mut child = start(program, arguments, Stdio::null());
    let pid = Pid::from_child(&child);
    // An ended process keeps its times until somebody waits for it.
    waitid(WaitId::Pid(pid), WaitIdOptions::EXITED | WaitIdOptions::NOWAIT).unwrap();
    let wall_s = (monotonic_ns() - begin_ns) as f64 / 1e9;
    let id = child.id();
    let [user_s, system_s] = cpu_times_s(&format!("/proc/{id}/stat"));
    let main_thread_s = cpu_times_s(&format!("/proc/{id}/task/{id}/stat")).iter().sum();
    let status = child.wait().unwrap();
    assert!(status.success(), "{program} {arguments:?} ended with {status}");
    Times { wall_s, user_s, system_s, main_thread_s }
}

/// Returns the user and the system time of a file `stat`, in seconds.
fn cpu_times_s(path: &str) -> [f64; 2] {
    let text = fs::read_to_string(path).unwrap();
    // The name of the program, in brackets, may contain spaces.
    let (_, fields) = text.rsplit_once(')').unwrap();
    let fields: Vec<_> = fields.split_whitespace().collect();
    [fields[11], fields[12]].map(|ticks| ticks.parse::<f64>().unwrap() * TICK_S)
}
