//! Ctrl-C and SIGTERM, for every program around a simulation: the first one asks for a clean end
//! (ports dropped, files finished), a second one exits at once.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Whether the user asked the program to end.
#[derive(Debug, Clone)]
pub struct Stop(Arc<AtomicBool>);

/// Exit code of an abrupt end: 128 + SIGINT, as shells report it.
const ABRUPT_EXIT: i32 = 130;

impl Stop {
    /// Installs the handlers of SIGINT and SIGTERM, once per process.
    ///
    /// # Errors
    /// The operating system refuses the handlers.
    pub fn install() -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // Registered first, so that it sees the flag as the signal before left it.
            flag::register_conditional_shutdown(signal, ABRUPT_EXIT, Arc::clone(&stop))
                .and_then(|_| flag::register(signal, Arc::clone(&stop)))?;
        }
        Ok(Self(stop))
    }

    /// Whether a signal has come.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
