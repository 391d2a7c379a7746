//! Membership in the lockstep: the node waits for each member before it computes a step.

use std::num::NonZeroU32;
use std::time::Duration;

use sim_messages::{
    MemberChange, MemberChangeKind, NodeStatus, Ready, SnapshotFlags, SnapshotHeader,
};
use thiserror::Error;

use crate::client::request::OwnerState;
use crate::ports::reader::ReadError;
use crate::ports::service::{READY, ServiceError};
use crate::ports::services::{AttachError, Attachment};
use crate::ports::writer::{PublishError, Writer};

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

/// The first step of a run at which a turn can begin.
#[derive(Debug, Clone, Copy, Default)]
struct Next {
    run_id: u64,
    step: u64,
}

/// A member's side of the lockstep.
#[derive(Debug)]
pub(crate) struct Member {
    writer: Writer<Ready>,
    turns: Turns,
    /// The node has been asked for the membership.
    has_asked: bool,
}

impl Member {
    pub(crate) fn create(
        attachment: &Attachment,
        client_id: u64,
        every: NonZeroU32,
    ) -> Result<Self, ServiceError> {
        let services = &attachment.services;
        let writer = Writer::of_values(&services.config, &services.ready, &READY)?;
        Ok(Self { writer, turns: Turns::new(client_id, every), has_asked: false })
    }

    /// Asks the node for the membership.
    pub(crate) fn join(&mut self) -> Result<(), LockstepError> {
        self.writer.send_value(self.turns.message)?;
        self.has_asked = true;
        Ok(())
    }

    pub(crate) fn has_asked(&self) -> bool {
        self.has_asked
    }

    /// Notes the step at which the node has admitted this member.
    pub(crate) fn admit(&mut self, run_id: u64, step: u64) {
        self.turns.next = Next { run_id, step };
    }

    /// Returns `true` between the snapshot of a turn and [`Self::ready`].
    pub(crate) fn is_in_turn(&self) -> bool {
        self.turns.is_in_turn
    }

    /// Returns `true` if a snapshot begins a turn of this member.
    pub(crate) fn takes_part(&self, header: &SnapshotHeader) -> bool {
        self.turns.begin_at(header)
    }

    /// Begins the turn of a snapshot. `status` is the newest one that has arrived.
    pub(crate) fn begin_turn(&mut self, header: &SnapshotHeader, status: Option<&NodeStatus>) {
        self.turns.begin(header, status);
    }

    pub(crate) fn missed_turn_count(&self) -> u64 {
        self.turns.missed_count
    }

    /// Ends the turn, if one has begun.
    pub(crate) fn ready(&mut self) -> Result<(), LockstepError> {
        if self.turns.is_in_turn {
            self.writer.send_value(self.turns.message)?;
            self.turns.is_in_turn = false;
        }
        Ok(())
    }
}

/// The turns of a member.
#[derive(Debug)]
struct Turns {
    /// The message of the last turn. Its run is 0 before the first one.
    message: Ready,
    next: Next,
    /// The turn has begun, and the message is not sent.
    is_in_turn: bool,
    /// Number of turns that the node has computed without this member.
    missed_count: u64,
}

impl Turns {
    fn new(client_id: u64, every: NonZeroU32) -> Self {
        let message = Ready { client_id, every: every.get(), tag: Ready::TAG, ..Ready::default() };
        Self { message, next: Next::default(), is_in_turn: false, missed_count: 0 }
    }

    /// Returns `true` if a snapshot begins a turn: the first one of a run, each one `every` steps after the last turn, and
    /// each one with a state that a command has put in place.
    fn begin_at(&self, header: &SnapshotHeader) -> bool {
        let Ready { run_id, step, .. } = self.message;
        let is_after_turn = header.run_id == run_id && header.step > step;
        let is_in_place = is_after_turn && header.flags & SnapshotFlags::IN_PLACE != 0;
        is_in_place || header.run_id != self.next.run_id || header.step >= self.next.step
    }

    fn begin(&mut self, header: &SnapshotHeader, status: Option<&NodeStatus>) {
        self.missed_count += self.count_before(header, status);
        let SnapshotHeader { run_id, step, .. } = *header;
        (self.message.run_id, self.message.step) = (run_id, step);
        self.next = Next { run_id, step: step + u64::from(self.message.every) };
        self.is_in_turn = true;
    }

    /// Returns the number of turns before a snapshot that the node has not waited for: the last one, if the member was
    /// dropped in it, and those since. A node publishes the multiples of its stride, and a few more steps after
    /// commands. A replay may lack snapshots, so none of its turns count.
    fn count_before(&self, header: &SnapshotHeader, status: Option<&NodeStatus>) -> u64 {
        if header.run_id != self.next.run_id || header.flags & SnapshotFlags::REPLAY != 0 {
            return 0;
        }
        let (every, stride) = (self.message.every.into(), u64::from(header.stride.max(1)));
        let next = self.next.step.next_multiple_of(stride);
        let since = header.step.saturating_sub(next).div_ceil(u64::next_multiple_of(every, stride));
        since + u64::from(status.is_some_and(|status| self.was_dropped(status)))
    }

    /// Returns `true` if the node has dropped the member in its last turn.
    fn was_dropped(&self, status: &NodeStatus) -> bool {
        let Ready { client_id, run_id, step, .. } = self.message;
        let is_drop = |change: &MemberChange| {
            (change.client_id, change.step) == (client_id, step)
                && change.kind == MemberChangeKind::TimedOut as u32
        };
        status.run_id == run_id && status.member_changes.iter_from(0).any(is_drop)
    }
}

#[cfg(test)]
mod tests {
    //! Checks which snapshots begin a turn, and which turns are missed.
    use super::*;

    const RUN: u64 = 9;

    fn header(step: u64) -> SnapshotHeader {
        SnapshotHeader { run_id: RUN, step, stride: 1, ..SnapshotHeader::default() }
    }

    /// A member that takes part in every fourth step, and was admitted at step 10.
    fn turns() -> Turns {
        let mut turns = Turns::new(7, NonZeroU32::new(4).unwrap());
        turns.next = Next { run_id: RUN, step: 10 };
        turns
    }

    fn status_after_drop(step: u64) -> NodeStatus {
        let mut status = NodeStatus { run_id: RUN, ..NodeStatus::default() };
        let kind = MemberChangeKind::TimedOut as u32;
        status.member_changes.add(MemberChange { client_id: 7, step, every: 4, kind });
        status
    }

    #[test]
    fn turns_begin_at_the_admission_and_every_fourth_step_from_there() {
        let mut turns = turns();
        assert!(!turns.begin_at(&header(9)) && turns.begin_at(&header(10)));
        let in_place = |step| SnapshotHeader { flags: SnapshotFlags::IN_PLACE, ..header(step) };
        assert!(!turns.begin_at(&in_place(9)), "before the admission");
        turns.begin(&header(10), None);
        assert!(!turns.begin_at(&header(13)) && turns.begin_at(&header(14)));
        assert!(turns.begin_at(&in_place(11)) && !turns.begin_at(&in_place(10)));
        turns.begin(&in_place(11), None);
        assert!(!turns.begin_at(&header(14)) && turns.begin_at(&header(15)));
        assert!(turns.begin_at(&SnapshotHeader { run_id: 8, ..header(0) }), "another run");
        assert_eq!(turns.missed_count, 0);
    }

    #[test]
    fn turns_without_the_member_are_missed() {
        let missed = |turns: &mut Turns, header, status: Option<NodeStatus>| {
            let before = turns.missed_count;
            turns.begin(&header, status.as_ref());
            turns.missed_count - before
        };
        let mut turns = turns();
        assert_eq!(missed(&mut turns, header(15), None), 2, "the first one since the admission");
        assert_eq!(missed(&mut turns, header(19), None), 0);
        assert_eq!(missed(&mut turns, header(32), None), 3, "those at 23, 27 and 31");
        // The node has gone on in the turn at step 32, and the member has answered before the next one.
        assert_eq!(missed(&mut turns, header(36), Some(status_after_drop(32))), 1);
        assert_eq!(missed(&mut turns, header(40), Some(status_after_drop(32))), 0, "counted");
        let other_run = NodeStatus { run_id: 8, ..status_after_drop(40) };
        assert_eq!(missed(&mut turns, header(44), Some(other_run)), 0);
        let replay = SnapshotHeader { flags: SnapshotFlags::REPLAY, ..header(60) };
        assert_eq!(missed(&mut turns, replay, None), 0);
        // With a stride of 5, each published step is a turn.
        let stride = |step| SnapshotHeader { stride: 5, ..header(step) };
        assert_eq!(missed(&mut turns, stride(65), None), 0);
        assert_eq!(missed(&mut turns, stride(80), None), 2);
        assert_eq!(missed(&mut turns, SnapshotHeader { run_id: 8, ..header(9) }, None), 0);
    }
}
