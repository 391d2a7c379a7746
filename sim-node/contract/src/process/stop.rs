//! Handling of Ctrl-C, SIGTERM and SIGHUP. The first signal requests a clean end (ports dropped, files
//! finished); a second one, unless it is SIGHUP, exits at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::{fs, io};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;

/// Flag that SIGINT, SIGTERM and SIGHUP set. The default one is not connected to a signal.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    flag: Arc<AtomicBool>,
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
        Ok(Self { flag, signals })
    }

    /// Returns the flag itself, for work that checks it often, such as a step of the solver.
    pub fn flag(&self) -> &AtomicBool {
        &self.flag
    }

    /// Returns the numbers of the handled signals.
    pub fn signals(&self) -> &[i32] {
        &self.signals
    }

    /// Returns `true` once a signal has arrived.
    pub fn is_requested(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }
}

/// Returns `true` if a process ignores a signal. `status` is its status in `/proc`; the line `SigIgn:`
/// has a bit for each signal in hexadecimal, and signal 1 has the lowest.
fn is_ignored(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
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
