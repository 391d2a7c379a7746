//! The limit on the size of files (`ulimit -f`).

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::SIGXFSZ;
use signal_hook::flag;

/// Makes a write beyond the limit fail with [`io::ErrorKind::FileTooLarge`]. By default, SIGXFSZ ends
/// the process without a message. Call it at the start of each program that writes files.
///
/// # Errors
/// The operating system refused the handler.
pub fn report_file_size_limit() -> io::Result<()> {
    // A handler instead of SIG_IGN, which child processes would inherit. The write reports the rest.
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map(drop)
}
