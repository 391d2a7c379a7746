//! The thread of a source.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::thread::{self, JoinHandle};

use anyhow::Context;

use super::feed::Source;
use crate::request::Requests;
use crate::shutdown::Shutdown;
use crate::sink::Sinks;

/// Starts the thread of a source. However the source ends, the shutdown begins.
///
/// # Errors
/// The system refuses another thread.
pub fn start_source(
    mut source: Box<dyn Source>,
    sinks: Sinks,
    requests: Requests,
    shutdown: Shutdown,
) -> anyhow::Result<JoinHandle<anyhow::Result<()>>> {
    thread::Builder::new()
        .name("source".to_owned())
        .spawn(move || {
            let result = catch_unwind(AssertUnwindSafe(|| source.run(&sinks, &requests)));
            shutdown.begin();
            result.unwrap_or_else(|panic| resume_unwind(panic))
        })
        .context("starting the thread of the source")
}
