//! Report of SIGBUS. The kernel sends it to a process that writes to shared memory of which no page is
//! left, or reads behind the end of a segment that another process has cut.

use std::fs;
use std::io::{self, Write, stderr};
use std::process;
use std::thread;

use signal_hook::consts::SIGBUS;
use signal_hook::iterator::Signals;
use signal_hook::low_level::raise;

const MESSAGE: &str = "error: a page of shared memory is missing (SIGBUS): /dev/shm is full, or another \
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
            let _ = writeln!(stderr(), "{MESSAGE}");
            process::exit(1);
        }
    };
    thread::Builder::new().name("bus-error".to_owned()).spawn(report).map(|_| ())
}

fn is_single_threaded() -> bool {
    fs::read_dir("/proc/self/task").is_ok_and(|threads| threads.count() == 1)
}
