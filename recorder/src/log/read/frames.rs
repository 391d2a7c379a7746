//! Groups the messages of a recording by snapshot.

use std::io::Read;

use sim_contract::ParticleState;

use super::decode::LoggedMessage;
use super::read_error::{LogEnd, ReadError};
use super::reader::LogReader;
use crate::log::backlog::Backlog;
use crate::log::message::Message;
use crate::log::rows::StepRow;

/// A snapshot and the messages between the previous snapshot and this one.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// In the order of publication, without `/steps` and `/particles`.
    pub updates: Vec<Message>,
    /// The header of the snapshot.
    pub row: StepRow,
    /// The payload of the snapshot. Shape: particle count.
    pub particles: Vec<ParticleState>,
}

impl Frame {
    /// Returns the keyframe that completes this snapshot, if there is one.
    pub fn own_keyframe(&self) -> Option<&[u8]> {
        self.updates.iter().rev().find_map(|update| match update {
            Message::Keyframe { step, bytes } if *step == self.row.step => Some(bytes.as_slice()),
            _ => None,
        })
    }
}

/// Reads a recording snapshot by snapshot.
#[derive(Debug)]
pub struct FrameReader<R> {
    log: LogReader<R>,
    updates: Vec<Message>,
    backlog: Backlog,
    row: Option<StepRow>,
}

impl<R: Read> FrameReader<R> {
    /// Continues from the current position of `log`.
    pub fn new(log: LogReader<R>) -> Self {
        let backlog = Backlog::new(log.run(), log.scene().len());
        Self { log, updates: Vec::new(), backlog, row: None }
    }

    /// Returns the recording.
    pub fn log(&self) -> &LogReader<R> {
        &self.log
    }

    /// Returns the end of the file, once [`FrameReader::next_frame`] has returned `None`.
    pub fn end(&self) -> Option<&LogEnd> {
        self.log.end()
    }

    /// Returns the next snapshot, or `None` at the end of the readable part.
    ///
    /// # Errors
    /// Like [`LogReader::next_message`], and if a snapshot has no row in `/steps`, a row has no snapshot,
    /// or the messages before a snapshot need more memory than a [`Backlog`] may.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, ReadError> {
        while let Some(LoggedMessage { message, .. }) = self.log.next_message()? {
            match message {
                Message::Step(row) => {
                    if let Some(StepRow { step, .. }) = self.row.replace(row) {
                        return Err(ReadError::NoSnapshot { step });
                    }
                }
                Message::Particles { step, particles } => {
                    let row = self.row.take().filter(|row| row.step == step);
                    let row = row.ok_or(ReadError::NoRow { step })?;
                    let updates = std::mem::take(&mut self.updates);
                    self.backlog.remove_to(step);
                    return Ok(Some(Frame { updates, row, particles }));
                }
                update => self.add_update(update)?,
            }
        }
        Ok(None)
    }

    fn add_update(&mut self, update: Message) -> Result<(), ReadError> {
        if !self.backlog.add(&update) {
            let (byte, size_bytes_max) = (self.log.intact_count(), self.backlog.size_bytes_max());
            return Err(ReadError::TooManyMessages { byte, size_bytes_max });
        }
        self.updates.push(update);
        Ok(())
    }

    /// Returns the row of a snapshot that is not in the file, as at its truncated end, once
    /// [`FrameReader::next_frame`] has returned `None`.
    pub fn trailing_row(&self) -> Option<&StepRow> {
        self.row.as_ref()
    }

    /// Returns the messages after the last snapshot, once [`FrameReader::next_frame`] has returned
    /// `None`.
    pub fn trailing_updates(&self) -> &[Message] {
        &self.updates
    }
}
