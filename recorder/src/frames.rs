//! Groups a recording's messages by the snapshot that they lead up to.

use std::io::Read;

use sim_contract::ParticleState;

use crate::message::Message;
use crate::reader::{LogReader, Logged, ReadError};
use crate::records::LogEnd;
use crate::rows::StepRow;

/// One snapshot and what was published between the one before and it.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// In the order of publication; all but `/steps` and `/particles`.
    pub updates: Vec<Message>,
    /// The snapshot's header.
    pub row: StepRow,
    /// The snapshot's payload. Shape: particle count.
    pub particles: Vec<ParticleState>,
}

impl Frame {
    /// The keyframe that completes this snapshot, if there is one.
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
    row: Option<StepRow>,
}

impl<R: Read> FrameReader<R> {
    /// Goes on from wherever `log` stands.
    pub fn new(log: LogReader<R>) -> Self {
        Self { log, updates: Vec::new(), row: None }
    }

    /// What is being read.
    pub fn log(&self) -> &LogReader<R> {
        &self.log
    }

    /// How the file ends; known once [`FrameReader::next_frame`] gave `None`.
    pub fn end(&self) -> Option<&LogEnd> {
        self.log.end()
    }

    /// The next snapshot, or `None` at the end of what is readable.
    ///
    /// # Errors
    /// As [`LogReader::next_message`]; and if a snapshot has no row in `/steps`.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, ReadError> {
        while let Some(Logged { message, .. }) = self.log.next_message()? {
            match message {
                Message::Step(row) => self.row = Some(row),
                Message::Particles { step, particles } => {
                    let row = self.row.take().filter(|row| row.step == step);
                    let row = row.ok_or(ReadError::NoRow { step })?;
                    let updates = std::mem::take(&mut self.updates);
                    return Ok(Some(Frame { updates, row, particles }));
                }
                update => self.updates.push(update),
            }
        }
        Ok(None)
    }

    /// What follows the last snapshot; known once [`FrameReader::next_frame`] gave `None`.
    pub fn trailing_updates(&self) -> &[Message] {
        &self.updates
    }
}
