//! Joining the lockstep.

use std::num::NonZeroU32;
use std::time::Duration;

use sim_host::clock::Deadline;

use crate::client::Client;
use crate::client::lockstep::{LockstepError, Member};

impl Client {
    /// Joins the lockstep: from now on, the node computes the step after a snapshot only when this client
    /// has called [`Client::ready`] for it. Dropping the client leaves the lockstep. A replay waits for its
    /// members with the next snapshot, so they read every one, at any rate.
    ///
    /// The node applies the commands that the members send before they are ready, and those of other
    /// clients that have arrived until then. The order is that of their client ids, so members with fixed
    /// ids ([`Client::attach_as`]) and without other clients produce the same states in every run.
    ///
    /// # Errors
    /// The lockstep already has [`crate::MEMBERS_MAX`] members, `/dev/shm` is full, or the node has not
    /// answered within `timeout`.
    pub fn join_lockstep(&mut self, timeout: Duration) -> Result<(), LockstepError> {
        self.join_lockstep_every(NonZeroU32::MIN, timeout)
    }

    /// Joins the lockstep, drops unread snapshots, and takes part only in every `every`-th step, as a controller of
    /// 60 Hz does beside a node of 240 Hz with `every` = 4.
    ///
    /// The first turn is at the step of joining, and each further turn `every` steps after the last one. A step that shows
    /// a load, a reset, a rewind or a restored state is always a turn, and so is step 0 of a new run; the next turn counts
    /// from there. A turn that falls on a step that the node does not publish (`--every`) moves to the next published step.
    ///
    /// # Errors
    /// Same as [`Client::join_lockstep`].
    pub fn join_lockstep_every(
        &mut self,
        every: NonZeroU32,
        timeout: Duration,
    ) -> Result<(), LockstepError> {
        self.request_membership(every)?;
        let joined = self.await_membership(timeout);
        if joined.is_err() {
            self.leave_lockstep();
        }
        joined
    }

    /// Begins to join the lockstep like [`Client::join_lockstep_every`], without waiting:
    /// [`Client::await_membership`] completes it.
    ///
    /// # Errors
    /// The lockstep already has [`crate::MEMBERS_MAX`] members, or `/dev/shm` is full.
    pub fn request_membership(&mut self, every: NonZeroU32) -> Result<(), LockstepError> {
        // The node may wait at a snapshot that this client has read: a new reader receives it again.
        self.particles = None;
        if let Some(status) = &mut self.status {
            status.read_again();
        }
        self.member = Some(Member::create(&self.attachment, self.id, every)?);
        Ok(())
    }

    /// Asks the node for the membership, and waits until it has admitted this client. After a timeout, it can be
    /// called again: a program that must react to something else waits in short parts. A client that gives up calls
    /// [`Client::leave_lockstep`], or the node waits for a client that does not know of its membership.
    ///
    /// The status names members by their client ids, so the client asks only when no member has its id: an earlier
    /// membership of this id has ended then.
    ///
    /// # Errors
    /// [`LockstepError::NotAdmitted`] after `timeout`, or the client has not asked to join.
    pub fn await_membership(&mut self, timeout: Duration) -> Result<(), LockstepError> {
        let deadline = Deadline::after(timeout);
        while let Some(status) = self.status(deadline.remaining())? {
            let member = self.member.as_mut().ok_or(LockstepError::NotJoined)?;
            match status.members().iter().find(|one| one.client_id == self.id) {
                Some(admission) if member.has_asked() => {
                    member.admit(status.run_id, admission.step);
                    return Ok(());
                }
                Some(_) => {}
                // Asks again, too: a node that waits only briefly may have dropped this client already.
                None => member.join()?,
            }
        }
        Err(LockstepError::not_admitted(&self.attachment, timeout))
    }

    /// Returns the number of turns that the node has computed without this client since it joined, up to the last
    /// turn of [`Client::next_turn`]. Those at the start of a new run are not counted. The node goes on without a
    /// member that it has waited for longer than its `--lockstep-timeout`, and the member joins again with its next
    /// turn. Turns of a replay are not counted, because a recording may lack snapshots.
    pub fn missed_turns(&self) -> u64 {
        self.member.as_ref().map_or(0, Member::missed_turn_count)
    }
}
