//! Signal dispositions that programs inherit from the tests.

use std::fs;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Once};

use signal_hook::consts::{SIGHUP, SIGINT};
use signal_hook::flag;

/// Makes programs that are started from now on receive SIGINT and SIGHUP, even if these tests were
/// started in the background or by `nohup`. A program inherits an ignored signal as ignored, but a
/// handled one as default. For the tests themselves, such a signal still has no effect.
pub(crate) fn receive_in_programs() {
    static HANDLERS: Once = Once::new();
    HANDLERS.call_once(|| {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let ignored = signal_mask(&status, "SigIgn").unwrap_or(0);
        for signal in [SIGINT, SIGHUP] {
            if ignored & (1 << (signal - 1)) != 0 {
                flag::register(signal, Arc::new(AtomicBool::new(false))).expect("a handler");
            }
        }
    });
}

/// Returns a line of a status in `/proc` that names signals, such as "SigIgn": signal n is bit n - 1.
pub(crate) fn signal_mask(status: &str, key: &str) -> Option<u64> {
    let line = |line: &str| line.strip_prefix(key)?.strip_prefix(':').map(str::to_owned);
    u64::from_str_radix(status.lines().find_map(line)?.trim(), 16).ok()
}
