//! Membership in the lockstep: the node waits for each member before it computes a step.

use std::num::NonZeroU32;
use std::time::Duration;

use thiserror::Error;

use crate::client::request::OwnerState;
use crate::messages::ready::Ready;
use crate::messages::snapshot::{SnapshotFlags, SnapshotHeader};
use crate::ports::reader::ReadError;
use crate::ports::service::{READY, ServiceError};
use crate::ports::services::{AttachError, Attachment};
use crate::ports::writer::{PublishError, ValueWriter};

/// Error of a member of the lockstep.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LockstepError {
    /// The client has not joined.
    #[error("this client is no member of the lockstep: call join_lockstep first")]
    NotJoined,
    /// The node did not confirm the membership.
    #[error("the lockstep did not admit this client within {timeout:?}: {owner}")]
    NotAdmitted {
        /// Longest wait.
        timeout: Duration,
        /// State of the owner after the wait.
        owner: OwnerState,
    },
    /// There is no node to attach to.
    #[error(transparent)]
    Attach(#[from] AttachError),
    /// A message could not be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The services have no place for another member, or no memory.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// A message could not be written into shared memory.
    #[error(transparent)]
    Publish(#[from] PublishError),
}

impl LockstepError {
    pub(crate) fn not_admitted(attachment: &Attachment, timeout: Duration) -> Self {
        Self::NotAdmitted { timeout, owner: OwnerState::query(attachment) }
    }
}

/// The step at which a node has admitted a member.
#[derive(Debug, Clone, Copy, Default)]
struct Joined {
    run_id: u64,
    step: u64,
}

/// A member's side of the lockstep.
#[derive(Debug)]
pub(crate) struct Member {
    writer: ValueWriter<Ready>,
    /// The message of the last turn.
    message: Ready,
    /// Place of the admission. Earlier snapshots are none of its turns.
    joined: Joined,
    /// The turn has begun, and the message is not sent.
    is_in_turn: bool,
    /// Number of turns that the node has computed without this member.
    missed_turn_count: u64,
}

impl Member {
    pub(crate) fn create(
        attachment: &Attachment,
        client_id: u64,
        every: NonZeroU32,
    ) -> Result<Self, ServiceError> {
        let services = &attachment.services;
        let message = Ready { client_id, every: every.get(), tag: Ready::TAG, ..Ready::default() };
        let writer = ValueWriter::create(&services.config, &services.ready, &READY)?;
        let joined = Joined::default();
        Ok(Self { writer, message, joined, is_in_turn: false, missed_turn_count: 0 })
    }

    /// Notes the step at which the node has admitted this member.
    pub(crate) fn admit(&mut self, run_id: u64, step: u64) {
        self.joined = Joined { run_id, step };
    }

    pub(crate) fn join(&self) -> Result<(), LockstepError> {
        self.writer.write(self.message)?;
        Ok(())
    }

    /// Returns `true` between the snapshot of a turn and [`Self::ready`].
    pub(crate) fn is_in_turn(&self) -> bool {
        self.is_in_turn
    }

    /// Returns `true` for a snapshot whose turn is this member's, and not yet ended.
    pub(crate) fn takes_part(&self, header: &SnapshotHeader) -> bool {
        let Ready { run_id, step, every, .. } = self.message;
        if header.run_id != run_id {
            return header.run_id != self.joined.run_id || header.step >= self.joined.step;
        }
        let is_in_place = header.step > step && header.flags & SnapshotFlags::IN_PLACE != 0;
        is_in_place || header.step >= step + u64::from(every)
    }

    pub(crate) fn begin_turn(&mut self, header: &SnapshotHeader) {
        self.missed_turn_count += self.turns_before(header);
        (self.message.run_id, self.message.step) = (header.run_id, header.step);
        self.is_in_turn = true;
    }

    /// Returns the number of turns between the last one and that of a snapshot. A node publishes the multiples of its
    /// stride, and a few more after commands; a replay may lack snapshots.
    fn turns_before(&self, header: &SnapshotHeader) -> u64 {
        let Ready { run_id, step, every, .. } = self.message;
        if header.run_id != run_id || header.flags & SnapshotFlags::REPLAY != 0 {
            return 0;
        }
        let (every, stride) = (u64::from(every), u64::from(header.stride.max(1)));
        let next = (step + every).next_multiple_of(stride);
        header.step.saturating_sub(next).div_ceil(every.next_multiple_of(stride))
    }

    pub(crate) fn missed_turn_count(&self) -> u64 {
        self.missed_turn_count
    }

    /// Ends the turn, if one has begun.
    pub(crate) fn ready(&mut self) -> Result<(), LockstepError> {
        if self.is_in_turn {
            self.writer.write(self.message)?;
            self.is_in_turn = false;
        }
        Ok(())
    }
}
