//! The memory of messages that wait for their snapshot.

use super::message::Message;
use super::run::RunDescription;
use super::scanner::limits::SizeLimits;
use super::topic::Topic;

/// The memory of the messages since the last snapshot.
///
/// A reader keeps these messages, so it needs a limit. A recorder that cannot write its snapshots,
/// because its disk stalls, drops messages beyond the same limit. Every file that it writes can be read.
#[derive(Debug)]
pub struct Backlog {
    size_bytes: usize,
    size_bytes_max: usize,
}

impl Backlog {
    /// Begins before the first message of a recording. `scene_size_bytes` is the length of its scene
    /// as text.
    pub fn new(run: &RunDescription, scene_size_bytes: usize) -> Self {
        let size_bytes_max = SizeLimits::new(run, scene_size_bytes).backlog_size_bytes_max();
        Self { size_bytes: 0, size_bytes_max }
    }

    /// Returns the most memory that messages without a snapshot may take.
    pub fn size_bytes_max(&self) -> usize {
        self.size_bytes_max
    }

    /// Returns `true` if a recorder may write the message now. Keyframes leave half of the memory to
    /// other messages: the next keyframe replaces a lost one, but nothing replaces a lost outcome.
    pub fn has_room_for(&self, message: &Message) -> bool {
        let is_keyframe = message.topic() == Topic::Keyframe;
        let limit = if is_keyframe { self.size_bytes_max / 2 } else { self.size_bytes_max };
        self.size_bytes + message.size_bytes() <= limit
    }

    /// Adds a message. Returns `false`, and adds nothing, if the messages would take more memory than
    /// they may.
    #[must_use]
    pub fn add(&mut self, message: &Message) -> bool {
        let size_bytes = message.size_bytes();
        if self.size_bytes.saturating_add(size_bytes) > self.size_bytes_max {
            return false;
        }
        self.size_bytes += size_bytes;
        true
    }

    /// Removes the messages, which a snapshot follows.
    pub fn clear(&mut self) {
        self.size_bytes = 0;
    }
}
