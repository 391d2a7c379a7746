//! The signals of a process: the requests to end (Ctrl-C, SIGTERM and SIGHUP), a missing page of shared memory
//! (SIGBUS), and the limit on the size of files (SIGXFSZ).

use std::io::{self, Write, stderr};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::{fs, ops, process, thread};

use signal_hook::consts::{SIGBUS, SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use signal_hook::low_level::raise;
use sim_types::StopFlag;

/// Flag that SIGINT, SIGTERM and SIGHUP set. The first signal requests a clean end (ports dropped, files
/// finished); a second one, unless it is SIGHUP, exits at once. The default flag is not connected to a signal.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    flag: StopFlag,
    signals: Vec<i32>,
}

/// Exit code of an abrupt end: 128 + SIGINT, as shells report it.
const ABRUPT_EXIT: i32 = 130;

impl Stop {
    /// Installs the handlers, once per process. A program that was started with `nohup` goes on to
    /// ignore SIGHUP, so that it outlives its terminal.
    ///
    /// # Errors
    /// The operating system refused the handlers.
    pub fn install() -> io::Result<Self> {
        let flag = Arc::new(AtomicBool::new(false));
        let mut signals = vec![SIGINT, SIGTERM];
        // Without a readable status, nothing is known to be ignored.
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        if !is_ignored(&status, SIGHUP) {
            signals.push(SIGHUP);
        }
        for signal in &signals {
            // A terminal that closes can send several SIGHUPs for one: the shell's and the kernel's.
            if *signal != SIGHUP {
                // Handlers run in order of registration: this one reads the flag before the next sets
                // it.
                flag::register_conditional_shutdown(*signal, ABRUPT_EXIT, Arc::clone(&flag))?;
            }
            flag::register(*signal, Arc::clone(&flag))?;
        }
        Ok(Self { flag: flag.into(), signals })
    }

    /// Returns the numbers of the handled signals.
    pub fn signals(&self) -> &[i32] {
        &self.signals
    }
}

impl ops::Deref for Stop {
    type Target = StopFlag;

    fn deref(&self) -> &StopFlag {
        &self.flag
    }
}

/// Returns `true` if a process ignores a signal. `status` is its status in `/proc`; the line `SigIgn:`
/// has a bit for each signal in hexadecimal, and signal 1 has the lowest.
fn is_ignored(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// The kernel sends SIGBUS to a process that writes to shared memory of which no page is left, or reads behind the
/// end of a segment that another process has cut.
const BUS_ERROR: &str = "error: a page of shared memory is missing (SIGBUS): /dev/shm is full, or another \
     process has cut a segment; free memory there, and start again";

/// Makes SIGBUS end the process with a message and exit code 1. Everything that a program itself writes
/// is allocated before; this covers what iceoryx2 writes when it connects two processes.
///
/// Call it before the process starts a thread. Otherwise the message may be lost.
///
/// # Errors
/// The system refused the handler or the thread that prints the message.
#[allow(clippy::exit, reason = "the thread that caused the signal cannot continue")]
pub fn report_bus_errors() -> io::Result<()> {
    // The standard library handles SIGBUS to find stack overflows, and `signal_hook` would call its
    // handler before ours. For any other cause that handler restores the default action and returns, so
    // the signal would end the process while the message is being written. This one triggers it. While
    // the handler of the standard library runs, threads that start or end would stop forever.
    if is_single_threaded() {
        raise(SIGBUS)?;
    }
    let mut signals = Signals::new([SIGBUS])?;
    // The thread that caused the signal repeats its access, and the signal, until this one exits.
    let report = move || {
        if signals.forever().next().is_some() {
            // A closed stderr changes nothing.
            let _ = writeln!(stderr(), "{BUS_ERROR}");
            process::exit(1);
        }
    };
    thread::Builder::new().name("bus-error".to_owned()).spawn(report).map(|_| ())
}

fn is_single_threaded() -> bool {
    fs::read_dir("/proc/self/task").is_ok_and(|threads| threads.count() == 1)
}

/// Makes a write beyond the limit on the size of files (`ulimit -f`) fail with [`io::ErrorKind::FileTooLarge`]. By default, SIGXFSZ ends
/// the process without a message. Call it at the start of each program that writes files.
///
/// # Errors
/// The operating system refused the handler.
pub fn report_file_size_limit() -> io::Result<()> {
    // A handler instead of SIG_IGN, which child processes would inherit. The write reports the rest.
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_the_status_of_a_process() {
        let status = |mask| format!("Name:\tx\nSigBlk:\t0000000000000001\nSigIgn:\t{mask}\n");
        assert!(is_ignored(&status("0000000000000001"), SIGHUP));
        // Rust programs ignore SIGPIPE, signal 13.
        assert!(!is_ignored(&status("0000000000001000"), SIGHUP));
        assert!(is_ignored(&status("0000000000001002"), SIGINT));
        assert!(!is_ignored("", SIGHUP) && !is_ignored(&status("?"), SIGHUP));
    }
}
