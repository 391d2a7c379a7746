//! Handling of Ctrl-C and SIGTERM. The first signal requests a clean end (ports dropped, files
//! finished); a second signal exits at once.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Flag that SIGINT and SIGTERM set.
#[derive(Debug, Clone)]
pub struct Stop(Arc<AtomicBool>);

/// Exit code of an abrupt end: 128 + SIGINT, as shells report it.
const ABRUPT_EXIT: i32 = 130;

impl Stop {
    /// Installs the handlers of SIGINT and SIGTERM, once per process.
    ///
    /// # Errors
    /// The operating system refused the handlers.
    pub fn install() -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // Handlers run in order of registration: this one reads the flag before the next sets it.
            flag::register_conditional_shutdown(signal, ABRUPT_EXIT, Arc::clone(&stop))
                .and_then(|_| flag::register(signal, Arc::clone(&stop)))?;
        }
        Ok(Self(stop))
    }

    /// Returns the flag itself, for work that checks it often, such as a step of the solver.
    pub fn flag(&self) -> &AtomicBool {
        &self.0
    }

    /// Returns `true` once a signal has arrived.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
