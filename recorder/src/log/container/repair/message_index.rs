//! The message indexes of the input, and a lost first chunk that they show.

use std::io::Write;

use mcap::records::MessageIndex;

use super::{Repair, RepairError, Section};
use crate::log::writer::WriteError;

impl<W: Write> Repair<W> {
    /// Compares a message index with its chunk, or counts the messages of a damaged chunk.
    pub(super) fn add_message_index(
        &mut self,
        byte: u64,
        index: &MessageIndex,
    ) -> Result<(), RepairError> {
        let is_intact = self.section == Section::Data;
        if is_intact && self.places.has_chunk() {
            // Its size and place matter only for the index of the file, which is rewritten.
            if let Err(what) = self.places.check_message_index(byte, 0, index) {
                self.findings.add_index(byte, "message index", what);
            }
        }
        if is_intact || self.content.is_none() {
            return Ok(());
        }
        self.begin()?;
        self.declare_channels()?;
        let (Some(salvage), Some(content)) = (&mut self.salvage, &self.content) else {
            return Ok(());
        };
        // Behind damage, the index may be that of the last intact chunk, whose messages are not lost.
        let is_copied = |time: u64| {
            self.section == Section::AfterDamage && time <= content.newest_log_time_ns()
        };
        let lost = index.records.iter().filter(|entry| !is_copied(entry.log_time));
        salvage.losses.add_indexed(content.topic(index.channel_id), lost.count() as u64);
        Ok(())
    }

    /// Declares the channels as a recorder does, if the first chunk, which declares them, is lost.
    pub(super) fn declare_channels(&mut self) -> Result<(), WriteError> {
        let (Some(salvage), Some(content)) = (&mut self.salvage, &mut self.content) else {
            return Ok(());
        };
        if content.has_channels() || !content.has_channels_of_today() {
            return Ok(());
        }
        salvage.declare_channels(content, self.load.take())
    }
}
