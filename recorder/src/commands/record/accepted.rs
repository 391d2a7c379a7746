//! The part of the messages of a node that goes into the recording.

use recording::{Message, ParticleBuffer};

use super::load::RunHeader;
use super::queue::Content;

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

/// The part of the messages since the last wait that goes into the recording.
#[derive(Debug, Default)]
pub(crate) struct Accepted {
    /// The header, when a file starts.
    pub(crate) header: Option<RunHeader>,
    pub(crate) contents: Vec<Content>,
    pub(crate) end: Option<RunEnd>,
    /// The buffer for the particles of the next snapshot.
    pub(crate) spare: ParticleBuffer,
}

impl Accepted {
    /// Adds a message.
    pub(super) fn push(&mut self, message: Message) {
        self.contents.push(Content::Update(message));
    }

    /// Sorts the contents in the order of publication: by step, then by topic.
    pub(crate) fn sort(&mut self) {
        self.contents.sort_by_key(|content| match content {
            Content::Update(message) => (message.step(), message.topic()),
            Content::Snapshot(row, _) => (row.step, recording::Topic::Steps),
        });
    }
}
