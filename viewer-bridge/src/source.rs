//! The sources: a live node or a recording.

pub mod live;
pub(crate) mod recording_files;
pub mod recording_times;
pub mod replay;
pub mod shown_state;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::thread::{self, JoinHandle};

use anyhow::Context;

use crate::message::Mode;
use crate::request::Requests;
use crate::scene::catalog::SceneEntry;
use crate::shutdown::Shutdown;
use crate::sink::Sinks;
use crate::source::recording_times::RecordingTimes;

/// A simulation that is shown to clients. It runs in a thread of its own.
pub trait Source: Send {
    /// Kind of source.
    fn mode(&self) -> Mode;

    /// The scenes that pages can load.
    fn scenes(&self) -> Vec<SceneEntry> {
        Vec::new()
    }

    /// Times of the recording, if the source is one.
    fn recording(&self) -> Option<RecordingTimes> {
        None
    }

    /// Publishes updates and answers requests until the program ends.
    ///
    /// An implementation publishes every change, states while there is a demand for them
    /// ([`Sinks::has_demand`]), and an answer to every command. It ends the grabs of a client that
    /// leaves.
    ///
    /// # Errors
    /// The source cannot continue. The absence of a node is not an error.
    fn run(&mut self, sinks: &Sinks, requests: &Requests) -> anyhow::Result<()>;
}

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
