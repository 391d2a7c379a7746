//! Groups the messages of a recording by snapshot.

use std::io::Read;

use sim_messages::ParticleState;

use super::decode::LoggedMessage;
use super::reader::{ChunkStart, LogReader};
use crate::log::message::{Backlog, Message, StepOrder};
use crate::log::read_error::{LogEnd, ReadError};
use crate::log::rows::StepRow;
use crate::log::source::FileSource;
use crate::log::topic::Topic;

/// A snapshot and the messages between the previous snapshot and this one.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// In the order of publication, without `/steps` and `/particles`.
    pub updates: Vec<Message>,
    /// The header of the snapshot.
    pub row: StepRow,
    /// The payload of the snapshot. Shape: particle count. `None` only in a recording of commands
    /// ([`ContentSelection::is_only_commands`]).
    ///
    /// [`ContentSelection::is_only_commands`]: crate::ContentSelection
    pub particles: Option<Vec<ParticleState>>,
    /// Times of reception of the updates, and of the header after them.
    pub log_times_ns: Vec<u64>,
}

impl Frame {
    /// Returns the payload, which is empty without one.
    pub fn payload(&self) -> &[ParticleState] {
        self.particles.as_deref().unwrap_or_default()
    }

    /// Returns the approximate memory use, in bytes.
    pub fn size_bytes(&self) -> usize {
        let updates_size_bytes: usize = self.updates.iter().map(Message::size_bytes).sum();
        size_of::<Self>() + size_of_val(self.payload()) + updates_size_bytes
    }

    /// Returns the keyframe that completes this snapshot, if there is one.
    pub fn own_keyframe(&self) -> Option<&[u8]> {
        self.updates.iter().rev().find_map(|update| match update {
            Message::Keyframe { step, bytes } if *step == self.row.step => Some(bytes.as_slice()),
            _ => None,
        })
    }

    /// Returns `true` if the snapshot has its particles and its keyframe.
    pub fn is_complete_state(&self) -> bool {
        self.particles.is_some() && self.own_keyframe().is_some()
    }
}

/// Reads a recording snapshot by snapshot.
#[derive(Debug)]
pub struct FrameReader<R> {
    log: LogReader<R>,
    updates: Vec<Message>,
    log_times_ns: Vec<u64>,
    backlog: Backlog,
    row: Option<StepRow>,
    /// The message that showed that the snapshot before it has no payload.
    next: Option<LoggedMessage>,
    is_only_commands: bool,
    order: StepOrder,
}

impl FrameReader<FileSource> {
    /// Continues at a chunk.
    pub(in crate::log) fn go_to(&mut self, chunk: &ChunkStart<'_>) {
        self.log.go_to(chunk);
        self.backlog = Backlog::new(self.log.run(), self.log.scene().len());
        self.updates.clear();
        self.log_times_ns.clear();
        (self.row, self.next) = (None, None);
        self.order = StepOrder::default();
    }

    /// Skips to the end of the snapshot of a step.
    pub(in crate::log) fn skip_to(&mut self, step: u64) -> Result<(), ReadError> {
        while let Some(logged) = self.log.next_message()? {
            if matches!(logged.message, Message::Particles { step: at, .. } if at == step) {
                break;
            }
        }
        self.order = StepOrder::after(step);
        Ok(())
    }
}

impl<R: Read> FrameReader<R> {
    /// Continues from the current position of `log`.
    pub fn new(log: LogReader<R>) -> Self {
        let backlog = Backlog::new(log.run(), log.scene().len());
        let is_only_commands = log.selection().is_only_commands;
        Self {
            log,
            updates: Vec::new(),
            log_times_ns: Vec::new(),
            backlog,
            row: None,
            next: None,
            is_only_commands,
            order: StepOrder::default(),
        }
    }

    /// Returns the recording.
    pub fn log(&self) -> &LogReader<R> {
        &self.log
    }

    /// Returns the end of the file, once [`FrameReader::next_frame`] has returned `None`.
    pub fn end(&self) -> Option<&LogEnd> {
        self.log.end()
    }

    /// Takes the memory of particles that are no longer needed, for those of later snapshots.
    pub(crate) fn add_spare(&mut self, particles: Vec<ParticleState>) {
        self.log.add_spare(particles);
    }

    /// Returns the next snapshot, or `None` at the end of the readable part.
    ///
    /// # Errors
    /// Like [`LogReader::next_message`], and if a snapshot has no row in `/steps`, a row has no snapshot,
    /// or the messages before a snapshot need more memory than a [`Backlog`] may.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, ReadError> {
        while let Some(logged) = self.next_message()? {
            if self.is_only_commands
                && let Some(row) = self.row
                && logged.message.topic() != Topic::Particles
            {
                self.next = Some(logged);
                return Ok(Some(self.take_frame(row, None)));
            }
            let LoggedMessage { message, log_time_ns, .. } = logged;
            match message {
                Message::Step(row) => {
                    if let Some(StepRow { step, .. }) = self.row.replace(row) {
                        return Err(ReadError::NoSnapshot { step });
                    }
                    self.log_times_ns.push(log_time_ns);
                }
                Message::Particles { step, particles } => {
                    let row = self.row.filter(|row| row.step == step);
                    let row = row.ok_or(ReadError::NoRow { step })?;
                    return Ok(Some(self.take_frame(row, Some(particles))));
                }
                update => {
                    self.add_update(update)?;
                    self.log_times_ns.push(log_time_ns);
                }
            }
        }
        match self.row.filter(|_| self.is_only_commands) {
            Some(row) => Ok(Some(self.take_frame(row, None))),
            None => Ok(None),
        }
    }

    fn next_message(&mut self) -> Result<Option<LoggedMessage>, ReadError> {
        if let Some(logged) = self.next.take() {
            return Ok(Some(logged));
        }
        let logged = self.log.next_message()?;
        if let Some(LoggedMessage { message, .. }) = &logged {
            let (topic, step) = (message.topic(), message.step());
            self.order.add(topic, step).map_err(|newest_step| ReadError::Order {
                topic: topic.name(),
                step,
                newest_step,
            })?;
        }
        Ok(logged)
    }

    fn take_frame(&mut self, row: StepRow, particles: Option<Vec<ParticleState>>) -> Frame {
        self.row = None;
        self.backlog.clear();
        Frame {
            updates: std::mem::take(&mut self.updates),
            row,
            particles,
            log_times_ns: std::mem::take(&mut self.log_times_ns),
        }
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

    /// Returns the times of reception of the trailing row and of the trailing updates, in their order.
    pub fn trailing_log_times_ns(&self) -> &[u64] {
        &self.log_times_ns
    }

    /// Returns the messages after the last snapshot, once [`FrameReader::next_frame`] has returned
    /// `None`.
    pub fn trailing_updates(&self) -> &[Message] {
        &self.updates
    }
}
