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

/// A member's side of the lockstep.
#[derive(Debug)]
pub(crate) struct Member {
    writer: ValueWriter<Ready>,
    /// The message of the last turn.
    message: Ready,
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
        Ok(Self { writer, message, is_in_turn: false, missed_turn_count: 0 })
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
        let is_new = header.run_id != run_id || header.step > step;
        is_new && header.step.is_multiple_of(every.into())
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
        let period = least_common_multiple(every.into(), header.stride.max(1).into());
        let next = (step / period + 1) * period;
        header.step.saturating_sub(next).div_ceil(period)
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

fn least_common_multiple(a: u64, b: u64) -> u64 {
    let (mut divisor, mut rest) = (a, b);
    while rest > 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    a / divisor * b
}
