//! Lost messages, as the indexes of the input count them.

use std::io::Write;

use mcap::records::MessageIndex;

use super::{Repair, RepairError, Section};
use crate::log::run::Closing;
use crate::log::topic::Topic;
use crate::log::writer::WriteError;

impl<W: Write> Repair<W> {
    /// Compares a message index with its chunk, or counts the messages of a damaged chunk.
    pub(super) fn add_message_index(
        &mut self,
        byte: u64,
        index: &MessageIndex,
    ) -> Result<(), RepairError> {
        // Its size and place matter only for the index of the file, which is rewritten.
        match self.section {
            Section::Data => {
                if self.places.has_chunk()
                    && let Err(what) = self.places.check_message_index(byte, 0, index)
                {
                    self.findings.add_index(byte, "message index", what);
                }
                return Ok(());
            }
            // It may be that of the last intact chunk, whose messages are not lost.
            Section::AfterDamage if self.places.check_message_index(byte, 0, index).is_ok() => {
                return Ok(());
            }
            _ => {}
        }
        let (channel_id, count) = (index.channel_id, index.records.len() as u64);
        if self.content.is_some() {
            self.begin()?;
        }
        match (&mut self.writer, &self.content) {
            (Some(writer), Some(content)) if content.has_channels() => {
                writer.losses.add_indexed(content.topic(channel_id), count);
            }
            _ => *self.undeclared.entry(channel_id).or_default() += count,
        }
        Ok(())
    }

    /// Declares the channels as a recorder does, if the first chunk, which declares them, is lost. Nothing is known then
    /// of what it had.
    pub(super) fn declare_lost_channels(&mut self) -> Result<(), WriteError> {
        self.declare_channels()?;
        let (Some(writer), Some(content)) = (&mut self.writer, &self.content) else {
            return Ok(());
        };
        for (channel_id, count) in std::mem::take(&mut self.undeclared) {
            writer.losses.add_indexed(content.topic(channel_id), count);
        }
        Ok(())
    }

    /// Declares the channels as a recorder does, if none is declared.
    pub(super) fn declare_channels(&mut self) -> Result<(), WriteError> {
        let (Some(writer), Some(content)) = (&mut self.writer, &mut self.content) else {
            return Ok(());
        };
        if content.has_channels() {
            return Ok(());
        }
        writer.mark_gap(content);
        writer.declare_channels(content, self.load.take())
    }

    /// Removes the numbers of written messages that the index of the file contradicts, if a byte of the data is
    /// wrong: it may be theirs.
    pub(super) fn without_damage(&self, mut closing: Closing) -> Closing {
        let (Some(indexed), Some(content)) = (&self.indexed, &self.content) else { return closing };
        if !self.has_wrong_checksum {
            return closing;
        }
        for topic in Topic::ALL {
            let of_topic = indexed.iter().filter(|(id, _)| content.topic(**id) == Some(topic));
            let count: u64 = of_topic.map(|(_, count)| count).sum();
            if closing.counts[topic].written != count {
                closing.counts[topic].written = 0;
            }
        }
        closing
    }
}
