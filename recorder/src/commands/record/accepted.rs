//! The part of a batch that goes into the recording.

use recorder::RunDescription;

use super::queue::Content;

/// The header of a recording.
#[derive(Debug)]
pub(crate) struct RunHeader {
    pub(crate) run: RunDescription,
    pub(crate) scene: Vec<u8>,
}

/// The reason why this file cannot record the rest of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RunEnd {
    /// The owner started another run.
    NewRun,
    /// The owner loaded another scene.
    NewLoad,
    /// The last requested step is recorded.
    EndStep,
}

/// The part of a batch that goes into the recording.
#[derive(Debug, Default)]
pub(crate) struct Accepted {
    /// The header, in the batch that starts the recording.
    pub(crate) header: Option<RunHeader>,
    /// In the order of publication.
    pub(crate) contents: Vec<Content>,
    pub(crate) end: Option<RunEnd>,
}
