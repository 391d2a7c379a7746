//! The memory of messages that wait for their snapshot.

use std::collections::BTreeMap;

use crate::log::message::Message;

/// The memory of the messages that were read and belong to no snapshot yet: those since the last
/// snapshot, and earlier ones with a later step, which the readers of a recording keep.
#[derive(Debug, Default)]
pub(super) struct Backlog {
    size_bytes: usize,
    /// By step.
    by_step: BTreeMap<u64, usize>,
}

impl Backlog {
    /// Adds a message. Returns the memory of all messages, in bytes.
    pub(super) fn add(&mut self, message: &Message) -> usize {
        let size_bytes = message.size_bytes();
        *self.by_step.entry(message.step()).or_default() += size_bytes;
        self.size_bytes += size_bytes;
        self.size_bytes
    }

    /// Removes the messages up to a snapshot.
    pub(super) fn remove_to(&mut self, step: u64) {
        while let Some(entry) = self.by_step.first_entry().filter(|entry| *entry.key() <= step) {
            self.size_bytes -= entry.remove();
        }
    }
}
