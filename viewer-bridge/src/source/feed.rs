//! The interface of a source.

use crate::message::Mode;
use crate::request::Requests;
use crate::scene::catalog::SceneEntry;
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
