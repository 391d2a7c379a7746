//! The channels of a file on topics of a recording.

use crate::log::topic::Topic;

/// Encoding of `/keyframe` before format 5.
const PLAIN_KEYFRAME_ENCODING: &str = "application/octet-stream";

/// A channel on a topic of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::log) struct TopicChannel {
    pub(in crate::log) topic: Topic,
    pub(in crate::log) keyframe_form: KeyframeForm,
}

/// The form of messages on `/keyframe`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::log) enum KeyframeForm {
    /// The solver's encoding alone, as in format 4 and earlier.
    Plain,
    /// A protobuf message with the step.
    Message,
}

impl TopicChannel {
    /// Returns the channel with this name and encoding, or `None` for one of another program.
    pub(in crate::log) fn new(name: &str, message_encoding: &str) -> Option<Self> {
        let keyframe_form = match message_encoding {
            PLAIN_KEYFRAME_ENCODING => KeyframeForm::Plain,
            _ => KeyframeForm::Message,
        };
        Some(Self { topic: Topic::from_name(name)?, keyframe_form })
    }

    /// Returns the first format version with such a channel.
    pub(in crate::log) fn first_version(self) -> u32 {
        match (self.topic, self.keyframe_form) {
            (Topic::Keyframe, KeyframeForm::Message) | (Topic::Forces, _) => 5,
            (Topic::Parameters, _) => 3,
            (Topic::Colliders, _) => 2,
            _ => 1,
        }
    }
}
