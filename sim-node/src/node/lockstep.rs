//! The lockstep: processes that the node waits for before it computes a step.

use std::hint::spin_loop;
use std::thread::yield_now;
use std::time::Duration;

use sim_contract::{
    ConnectionId, MEMBERS_MAX, MemberChange, MemberChangeKind, MemberChanges, MemberStatus, Ready,
};
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until};

use super::publisher::Publisher;

/// Time for which the node polls without a pause. Most members answer within it.
const SPIN_NS: u64 = 100_000;
/// Number of looks between two chances for another thread of this core, such as a member.
const LOOKS_PER_YIELD: u32 = 16;
/// Pause between two looks after that.
const PAUSE_NS: u64 = 50_000;
/// Time between two searches for killed members, which cost system calls.
const SEARCH_PERIOD_NS: u64 = SECOND_NS / 10;

/// The members of the lockstep.
#[derive(Debug)]
pub(super) struct Lockstep {
    /// In the order of joining.
    members: Vec<Member>,
    /// Longest wait for a member.
    timeout: Duration,
    /// Since when the node waits for the members; `None` if it does not.
    waiting_since_ns: Option<u64>,
    next_search_ns: u64,
    /// The changes of this run, for the status.
    pub(super) changes: MemberChanges,
    /// Messages of clients that are not members, or that claim a step of the future.
    pub(super) refused_count: u64,
}

#[derive(Debug)]
struct Member {
    connection: ConnectionId,
    client_id: u64,
    every: u64,
    /// Step at which it joined.
    joined: u64,
    /// Last step that it was ready for.
    ready: Option<u64>,
}

impl Member {
    fn is_awaited(&self, last: Published) -> bool {
        let Published { step, is_in_place, .. } = last;
        self.ready.is_none_or(|ready| (is_in_place && ready < step) || step >= ready + self.every)
    }
}

/// The last published step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Published {
    run_id: u64,
    step: u64,
    /// A command has put its state in place, so that every member has a turn.
    is_in_place: bool,
}

impl Published {
    pub(super) fn new(publisher: &Publisher, step: u64) -> Self {
        Self {
            run_id: publisher.run_id(),
            step,
            is_in_place: publisher.has_published_in_place(step),
        }
    }
}

impl Lockstep {
    pub(super) fn new(timeout: Duration) -> Self {
        Self {
            members: Vec::new(),
            timeout,
            waiting_since_ns: None,
            next_search_ns: 0,
            changes: MemberChanges::default(),
            refused_count: 0,
        }
    }

    pub(super) fn has_members(&self) -> bool {
        !self.members.is_empty()
    }

    /// Awaits every member at step 0 of a new run.
    pub(super) fn begin_run(&mut self) {
        for member in &mut self.members {
            (member.joined, member.ready) = (0, None);
        }
        self.waiting_since_ns = None;
        self.changes = MemberChanges::default();
    }

    /// Waits until all members are ready for `step`, at most until `until_ns`. Returns `true` if they
    /// are. Members that are gone, or have kept the node waiting for too long, are removed.
    pub(super) fn wait(
        &mut self,
        publisher: &Publisher,
        step: u64,
        until_ns: u64,
        mut report: impl FnMut(Event),
    ) -> bool {
        let last = Published::new(publisher, step);
        let start_ns = monotonic_ns();
        let mut look_count = 0_u32;
        loop {
            self.receive(publisher, last, &mut report);
            if !self.is_waiting(last) {
                self.waiting_since_ns = None;
                return true;
            }
            let now_ns = monotonic_ns();
            self.remove_lost(publisher, last, now_ns, &mut report);
            if now_ns >= until_ns {
                return !self.is_waiting(last);
            }
            look_count += 1;
            if now_ns > start_ns + SPIN_NS {
                sleep_until(now_ns + PAUSE_NS);
            } else if look_count.is_multiple_of(LOOKS_PER_YIELD) {
                yield_now();
            } else {
                spin_loop();
            }
        }
    }

    /// Receives the messages that have arrived.
    pub(super) fn receive(
        &mut self,
        publisher: &Publisher,
        last: Published,
        report: &mut impl FnMut(Event),
    ) {
        publisher.receive_ready(|message, connection| {
            // A message of a closed connection, which it sent before its end, joins nothing.
            if self.is_member(connection) || publisher.listed_members().contains(&connection) {
                self.add(message, connection, last, report);
            }
        });
    }

    fn add(
        &mut self,
        message: Ready,
        connection: ConnectionId,
        last: Published,
        report: &mut impl FnMut(Event),
    ) {
        let is_of_run = message.run_id == last.run_id;
        if !message.is_valid() || (is_of_run && message.step > last.step) {
            self.refused_count += 1;
            return;
        }
        let ready = is_of_run.then_some(message.step);
        let every = u64::from(message.every);
        let known = self.members.iter_mut().find(|member| member.connection == connection);
        if let Some(member) = known {
            member.every = every;
            member.ready = member.ready.max(ready);
        } else if self.members.len() < MEMBERS_MAX {
            let client_id = message.client_id;
            self.members.push(Member { connection, client_id, every, joined: last.step, ready });
            report(Event::Joined { client_id, every });
        } else {
            self.refused_count += 1;
        }
    }

    fn is_member(&self, connection: ConnectionId) -> bool {
        self.members.iter().any(|member| member.connection == connection)
    }

    fn is_waiting(&self, last: Published) -> bool {
        self.members.iter().any(|member| member.is_awaited(last))
    }

    /// Removes the members that are gone, and those that the node has waited for too long.
    fn remove_lost(
        &mut self,
        publisher: &Publisher,
        last: Published,
        now_ns: u64,
        report: &mut impl FnMut(Event),
    ) {
        let since_ns = *self.waiting_since_ns.get_or_insert(now_ns);
        let is_search_due = now_ns >= self.next_search_ns;
        let connections = if is_search_due {
            self.next_search_ns = now_ns + SEARCH_PERIOD_NS;
            publisher.living_members()
        } else {
            publisher.listed_members()
        };
        let waited = Duration::from_nanos(now_ns.saturating_sub(since_ns));
        let timeout = self.timeout;
        self.remove_gone(publisher, &connections, report);
        self.members.retain(|member| {
            let has_timed_out = waited > timeout && member.is_awaited(last);
            if has_timed_out {
                let Member { client_id, every, .. } = *member;
                report(Event::TimedOut { client_id, every, timeout });
            }
            !has_timed_out
        });
    }

    /// Removes the members that are gone, a few times a second, also while the node does not wait for them.
    pub(super) fn search(&mut self, publisher: &Publisher, report: &mut impl FnMut(Event)) {
        let now_ns = monotonic_ns();
        if self.members.is_empty() || now_ns < self.next_search_ns {
            return;
        }
        self.next_search_ns = now_ns + SEARCH_PERIOD_NS;
        self.remove_gone(publisher, &publisher.living_members(), report);
    }

    /// Removes the members without a connection. A connection that is still listed was not closed.
    fn remove_gone(
        &mut self,
        publisher: &Publisher,
        connections: &[ConnectionId],
        report: &mut impl FnMut(Event),
    ) {
        let is_there = |member: &Member| connections.contains(&member.connection);
        if self.members.iter().all(is_there) {
            return;
        }
        let listed = publisher.listed_members();
        self.members.retain(|member| {
            let Member { client_id, every, connection, .. } = *member;
            if !is_there(member) {
                let was_killed = listed.contains(&connection);
                report(if was_killed {
                    Event::Killed { client_id, every }
                } else {
                    Event::Left { client_id, every }
                });
            }
            is_there(member)
        });
    }

    /// Returns the members in the order of joining.
    pub(super) fn members(&self, last: Published) -> impl Iterator<Item = MemberStatus> {
        self.members.iter().map(move |member| MemberStatus {
            client_id: member.client_id,
            step: member.ready.unwrap_or(member.joined),
            every: u32::try_from(member.every).unwrap_or(u32::MAX),
            is_awaited: u32::from(member.is_awaited(last)),
        })
    }
}

/// A change of the members. The member takes part in every `every`-th step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Event {
    Joined {
        client_id: u64,
        every: u64,
    },
    /// It closed its connection.
    Left {
        client_id: u64,
        every: u64,
    },
    /// Its process ended without closing the connection.
    Killed {
        client_id: u64,
        every: u64,
    },
    /// It was not ready in time.
    TimedOut {
        client_id: u64,
        every: u64,
        timeout: Duration,
    },
}

impl Event {
    /// Returns the line for people. `step` is the last one that was computed.
    pub(super) fn describe(self, step: u64) -> String {
        match self {
            Self::Joined { client_id, every: 1 } => {
                format!("client {client_id} joined the lockstep at step {step}")
            }
            Self::Joined { client_id, every } => format!(
                "client {client_id} joined the lockstep at step {step}, for every {every} steps"
            ),
            Self::Left { client_id, .. } => {
                format!("client {client_id} left the lockstep at step {step}")
            }
            Self::Killed { client_id, .. } => {
                format!("client {client_id} left the lockstep at step {step}: its process ended")
            }
            Self::TimedOut { client_id, timeout, .. } => format!(
                "client {client_id} was not ready for the step after {step} within {timeout:?}: the \
                 lockstep continues without it, until it is ready for a step again"
            ),
        }
    }

    /// Returns the entry of the status. `step` is the last one that was computed.
    pub(super) fn to_change(self, step: u64) -> MemberChange {
        let (client_id, every, kind) = match self {
            Self::Joined { client_id, every } => (client_id, every, MemberChangeKind::Joined),
            Self::Left { client_id, every } => (client_id, every, MemberChangeKind::Left),
            Self::Killed { client_id, every } => (client_id, every, MemberChangeKind::Killed),
            Self::TimedOut { client_id, every, .. } => {
                (client_id, every, MemberChangeKind::TimedOut)
            }
        };
        let every = u32::try_from(every).unwrap_or(u32::MAX);
        MemberChange { client_id, step, every, kind: kind as u32 }
    }
}

#[cfg(test)]
mod tests {
    //! Checks who is awaited, with messages given to `Lockstep::add`.
    use sim_contract::CLIENT_ID_END;

    use super::*;

    const RUN: u64 = 9;

    fn ready(client_id: u64, step: u64, every: u32) -> Ready {
        Ready { client_id, run_id: RUN, step, every, tag: Ready::TAG }
    }

    fn lockstep() -> Lockstep {
        Lockstep::new(Duration::from_secs(1))
    }

    fn last(step: u64) -> Published {
        Published { run_id: RUN, step, is_in_place: false }
    }

    #[test]
    fn a_member_is_awaited_at_its_steps_until_it_is_ready() {
        let mut lockstep = lockstep();
        let join = Ready { run_id: 0, ..ready(7, 0, 4) };
        let mut events = Vec::new();
        let mut add = |lockstep: &mut Lockstep, message, step| {
            lockstep.add(message, ConnectionId(1), last(step), &mut |event| events.push(event));
        };
        let is_waiting = |lockstep: &Lockstep, step| lockstep.is_waiting(last(step));
        add(&mut lockstep, join, 2);
        assert!(is_waiting(&lockstep, 2), "the count begins at the step of joining");
        add(&mut lockstep, ready(7, 2, 4), 2);
        assert_eq!([2, 5, 6].map(|step| is_waiting(&lockstep, step)), [false, false, true]);
        // An older message changes nothing, and one of another run neither.
        add(&mut lockstep, ready(7, 0, 4), 6);
        add(&mut lockstep, Ready { run_id: 8, ..ready(7, 8, 4) }, 8);
        assert_eq!([5, 6].map(|step| is_waiting(&lockstep, step)), [false, true]);
        // A state in place is a turn, and the count begins again.
        add(&mut lockstep, ready(7, 6, 4), 6);
        let in_place = Published { is_in_place: true, ..last(7) };
        assert!(lockstep.is_waiting(in_place) && !is_waiting(&lockstep, 7));
        assert!(!is_waiting(&lockstep, 8), "a member that was dropped there and joins again");
        add(&mut lockstep, ready(7, 7, 4), 7);
        assert!(!lockstep.is_waiting(in_place));
        assert_eq!([10, 11].map(|step| is_waiting(&lockstep, step)), [false, true]);
        assert_eq!(events, [Event::Joined { client_id: 7, every: 4 }]);
        assert_eq!(lockstep.refused_count, 0);
    }

    #[test]
    fn foreign_messages_are_refused_and_counted() {
        let mut lockstep = lockstep();
        let messages = [
            Ready { tag: 0, ..ready(7, 0, 1) },
            ready(7, 0, 0),
            ready(CLIENT_ID_END, 0, 1),
            // The step is not computed yet.
            ready(7, 3, 1),
        ];
        for message in messages {
            lockstep.add(message, ConnectionId(1), last(2), &mut |_| panic!("joined"));
        }
        assert_eq!(lockstep.refused_count, 4);
        assert_eq!(lockstep.members(last(2)).count(), 0);
    }

    #[test]
    fn the_lockstep_has_a_limit() {
        let mut lockstep = lockstep();
        for connection in 0..=MEMBERS_MAX as u128 {
            lockstep.add(ready(7, 0, 1), ConnectionId(connection), last(0), &mut |_| {});
        }
        assert_eq!((lockstep.members(last(0)).count(), lockstep.refused_count), (MEMBERS_MAX, 1));
    }
}
