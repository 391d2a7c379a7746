//! The lockstep of a replay: readers that it waits for, so that they miss no snapshot.

use sim_contract::{ConnectionId, MEMBERS_MAX, MemberStatus, Owner, Ready};
use sim_host::clock::SECOND_NS;

use crate::cli::output;

/// Time between two searches for members that are gone, which cost system calls.
const SEARCH_PERIOD_NS: u64 = SECOND_NS / 10;
/// Longest wait for a member.
const TIMEOUT_NS: u64 = 10 * SECOND_NS;

/// The members of the lockstep.
#[derive(Debug, Default)]
pub(super) struct Lockstep {
    /// In the order of joining.
    members: Vec<Member>,
    /// Since when the replay waits for a member; `None` if it does not.
    waiting_since_ns: Option<u64>,
    next_search_ns: u64,
}

#[derive(Debug)]
struct Member {
    connection: ConnectionId,
    client_id: u64,
    every: u32,
    /// Step at which it joined.
    joined: u64,
    /// Last step that it was ready for.
    ready: Option<u64>,
}

/// The last published step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Published {
    pub(super) run_id: u64,
    pub(super) step: u64,
}

impl Member {
    fn is_awaited(&self, step: u64) -> bool {
        self.ready.is_none_or(|ready| step >= ready + u64::from(self.every))
    }
}

impl Lockstep {
    /// Awaits every member at the first snapshot of a run.
    pub(super) fn begin_run(&mut self) {
        self.members.iter_mut().for_each(|member| member.ready = None);
        self.waiting_since_ns = None;
    }

    /// Receives the messages of the members, and removes members that are gone.
    pub(super) fn receive(&mut self, owner: &Owner, last: Published, now_ns: u64) {
        owner.receive_ready(|message, connection| self.add(message, connection, last));
        if !self.members.is_empty() && now_ns >= self.next_search_ns {
            self.next_search_ns = now_ns + SEARCH_PERIOD_NS;
            let living = owner.living_members();
            self.members.retain(|member| living.contains(&member.connection));
        }
    }

    /// Returns `true` if a member is not ready for a published step. Removes members that keep the replay
    /// waiting for too long.
    pub(super) fn is_waiting(&mut self, step: u64, now_ns: u64) -> bool {
        self.remove_late(step, now_ns);
        let is_waiting = self.members.iter().any(|member| member.is_awaited(step));
        self.waiting_since_ns = is_waiting.then_some(self.waiting_since_ns.unwrap_or(now_ns));
        is_waiting
    }

    fn add(&mut self, message: Ready, connection: ConnectionId, last: Published) {
        let is_of_run = message.run_id == last.run_id;
        if !message.is_valid() || (is_of_run && message.step > last.step) {
            return;
        }
        let ready = is_of_run.then_some(message.step);
        let Ready { client_id, every, .. } = message;
        let known = self.members.iter_mut().find(|member| member.connection == connection);
        if let Some(member) = known {
            member.ready = member.ready.max(ready);
        } else if self.members.len() < MEMBERS_MAX {
            self.members.push(Member { connection, client_id, every, joined: last.step, ready });
        }
    }

    fn remove_late(&mut self, step: u64, now_ns: u64) {
        if self.waiting_since_ns.is_none_or(|since_ns| now_ns < since_ns + TIMEOUT_NS) {
            return;
        }
        self.members.retain(|member| {
            let is_late = member.is_awaited(step);
            if is_late {
                output::note(&format!(
                    "warning: client {} was not ready for step {step} within {} s; the replay goes on \
                     without it",
                    member.client_id,
                    TIMEOUT_NS / SECOND_NS
                ));
            }
            !is_late
        });
    }

    /// Waits for nobody, as while paused.
    pub(super) fn rest(&mut self) {
        self.waiting_since_ns = None;
    }

    /// Returns the members in the order of joining. `step` is the last published one.
    pub(super) fn members(&self, step: u64) -> impl Iterator<Item = MemberStatus> {
        self.members.iter().map(move |member| MemberStatus {
            client_id: member.client_id,
            step: member.ready.unwrap_or(member.joined),
            every: member.every,
            is_awaited: u32::from(member.is_awaited(step)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAST: Published = Published { run_id: 9, step: 8 };

    fn ready(run_id: u64, step: u64) -> Ready {
        Ready { client_id: 7, run_id, step, every: 4, tag: Ready::TAG }
    }

    fn awaited(lockstep: &Lockstep, step: u64) -> Vec<u32> {
        lockstep.members(step).map(|member| member.is_awaited).collect()
    }

    #[test]
    fn a_member_is_awaited_at_its_steps_until_it_is_ready_and_again_in_the_next_run() {
        let mut lockstep = Lockstep::default();
        lockstep.add(ready(0, 0), ConnectionId(1), LAST);
        assert_eq!((awaited(&lockstep, 8), awaited(&lockstep, 9)), (vec![1], vec![1]));
        // Steps of another run, or of the future, are none of this one.
        lockstep.add(ready(3, 8), ConnectionId(1), LAST);
        lockstep.add(ready(9, 12), ConnectionId(1), LAST);
        lockstep.add(Ready { tag: 0, ..ready(9, 8) }, ConnectionId(1), LAST);
        assert_eq!(awaited(&lockstep, 8), [1]);
        lockstep.add(ready(9, 8), ConnectionId(1), LAST);
        assert_eq!((awaited(&lockstep, 11), awaited(&lockstep, 12)), (vec![0], vec![1]));
        lockstep.begin_run();
        assert_eq!(awaited(&lockstep, 0), [1]);
    }

    #[test]
    fn the_lockstep_has_a_limit_and_drops_a_member_that_is_late() {
        let mut lockstep = Lockstep::default();
        for connection in 0..=MEMBERS_MAX as u128 {
            lockstep.add(ready(0, 0), ConnectionId(connection), LAST);
        }
        assert_eq!(lockstep.members(8).count(), MEMBERS_MAX);
        lockstep.add(ready(9, 8), ConnectionId(3), LAST);
        lockstep.waiting_since_ns = Some(5);
        lockstep.remove_late(8, 5 + TIMEOUT_NS - 1);
        assert_eq!(lockstep.members(8).count(), MEMBERS_MAX);
        lockstep.remove_late(8, 5 + TIMEOUT_NS);
        assert_eq!(lockstep.members(8).count(), 1);
    }
}
