//! The messages of a node between two waits, the part of them that goes into the recording, and the reasons why a file ends.

use recording::{Message, ParticleBuffer};
use sim_contract::{KeyframeHeader, NodeStatus, OUTCOME_FLAG_CONTROL, Outcome, Update};

use super::queue::Content;
use super::start::RunHeader;

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
pub(crate) struct Batch {
    /// The header, when a file starts.
    pub(crate) header: Option<RunHeader>,
    pub(crate) contents: Vec<Content>,
    pub(crate) end: Option<RunEnd>,
    /// The buffer for the particles of the next snapshot.
    pub(crate) spare: ParticleBuffer,
}

impl Batch {
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

/// Copies of the messages that a tap passes on between two states. A paused node publishes outcomes
/// long before the state that contains their effect.
#[derive(Debug, Default)]
pub(crate) struct Messages {
    pub(crate) keyframes: Vec<(KeyframeHeader, Vec<u8>)>,
    pub(crate) outcomes: Vec<Outcome>,
    pub(crate) statuses: Vec<NodeStatus>,
}

impl Messages {
    /// Copies a message of these services. Skips the answers of a replay to its controls, which are
    /// not part of the recorded run.
    pub(crate) fn add(&mut self, update: &Update<'_>) {
        match *update {
            Update::Keyframe(header, bytes) => self.keyframes.push((*header, bytes.to_vec())),
            Update::Outcome(outcome) if outcome.flags & OUTCOME_FLAG_CONTROL == 0 => {
                self.outcomes.push(*outcome);
            }
            Update::Status(status) => self.statuses.push(*status),
            _ => {}
        }
    }
}

/// The reason why a recording or one of its files ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopReason {
    Signal,
    Duration,
    OwnerGone,
    Run(RunEnd),
    /// The file has reached a limit, and the next one begins.
    Split,
    WriteError,
    /// The disk has less free space than its reserve.
    Reserve,
    /// The reader of the progress has gone.
    ReaderGone,
}

impl StopReason {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Signal => "signal",
            Self::Duration => "duration reached",
            Self::OwnerGone => "owner gone",
            Self::Run(RunEnd::NewRun) => "new run",
            Self::Run(RunEnd::NewLoad) => "new scene loaded",
            Self::Run(RunEnd::EndStep) => "steps reached",
            Self::Split => "split",
            Self::WriteError => "write error",
            Self::Reserve => "disk reserve reached",
            Self::ReaderGone => "reader of the progress gone",
        }
    }

    /// Returns an explanation of an end that the user has not asked for, and that `--follow` prevents.
    pub(crate) fn hint(self) -> Option<&'static str> {
        match self {
            Self::OwnerGone => Some(
                "the recording ended with the node; with --follow, it goes on with the next run, in \
                 another file",
            ),
            Self::Run(RunEnd::NewRun) => Some(
                "the recording ended because another run began; with --follow, it goes on in another \
                 file",
            ),
            Self::Run(RunEnd::NewLoad) => Some(
                "the recording ended because another scene was loaded; with --follow, it goes on in \
                 another file",
            ),
            Self::Signal
            | Self::Duration
            | Self::Run(RunEnd::EndStep)
            | Self::Split
            | Self::WriteError
            | Self::Reserve
            | Self::ReaderGone => None,
        }
    }
}
