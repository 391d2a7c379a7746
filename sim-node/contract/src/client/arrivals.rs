//! Snapshots from behind a network tunnel, put back into order with the other messages.
//!
//! A tunnel moves the services one after the other, so a snapshot can arrive before messages that were
//! published before it. So each one waits: until its load and everything that its header counts is there, and
//! for a moment in any case, for what it does not count, such as the parameters.

use std::collections::VecDeque;

use sim_host::clock::SECOND_NS;
use sim_messages::{ParticleState, SNAPSHOTS_BUFFERED, SnapshotHeader, Update};

/// Shortest wait of a snapshot: several rounds of a tunnel that looks for messages every 2 ms.
const WAIT_MIN_NS: u64 = SECOND_NS / 20;
/// Longest wait, for messages that the tunnel has lost.
const WAIT_MAX_NS: u64 = SECOND_NS;
/// Most waiting snapshots: several times as many as the tunnel can deliver at once.
const WAITING_MAX: usize = 4 * SNAPSHOTS_BUFFERED;

/// A copy of a snapshot.
#[derive(Debug)]
pub(crate) struct Copied {
    pub(crate) header: SnapshotHeader,
    pub(crate) particles: Vec<ParticleState>,
}

/// The snapshots that wait, in the order of publication.
#[derive(Debug, Default)]
pub(crate) struct Arrivals {
    waiting: VecDeque<(u64, Copied)>,
    /// Run of the last added snapshot.
    run_id: u64,
    seen: Seen,
}

/// The messages of the run that have arrived.
#[derive(Debug, Default)]
struct Seen {
    run_id: u64,
    /// Number of outcomes up to the last one that arrived.
    outcome_count: u64,
    /// Number of torn constraints in the last list.
    torn_count: u32,
    keyframe_step: u64,
}

impl Arrivals {
    pub(crate) fn has_place(&self) -> bool {
        self.waiting.len() < WAITING_MAX
    }

    /// Adds a snapshot that arrived at `now_ns`.
    pub(crate) fn add(
        &mut self,
        header: &SnapshotHeader,
        particles: &[ParticleState],
        now_ns: u64,
    ) {
        if self.run_id != header.run_id {
            // Outcomes from before this reader has joined do not come.
            self.run_id = header.run_id;
            self.seen.begin_run(header.run_id);
            self.seen.outcome_count = self.seen.outcome_count.max(header.outcome_count);
        }
        self.waiting.push_back((now_ns, Copied { header: *header, particles: particles.to_vec() }));
    }

    /// Notes a message that snapshots count.
    pub(crate) fn note(&mut self, update: &Update<'_>) {
        match *update {
            Update::Outcome(outcome) => {
                self.seen.begin_run(outcome.run_id);
                self.seen.outcome_count = self.seen.outcome_count.max(outcome.index + 1);
            }
            Update::Tears(header, _) => {
                self.seen.begin_run(header.run_id);
                self.seen.torn_count = header.count;
            }
            Update::Keyframe(header, _) => {
                self.seen.begin_run(header.run_id);
                self.seen.keyframe_step = header.step;
            }
            _ => {}
        }
    }

    /// Returns the first waiting snapshot.
    pub(crate) fn first(&self) -> Option<&SnapshotHeader> {
        self.waiting.front().map(|(_, first)| &first.header)
    }

    /// Removes and returns the first snapshot if it need not wait any longer. `has_load` says whether the load
    /// of a snapshot has arrived.
    pub(crate) fn next(
        &mut self,
        now_ns: u64,
        has_load: impl Fn(&SnapshotHeader) -> bool,
    ) -> Option<Copied> {
        let (arrival_ns, first) = self.waiting.front()?;
        let waited_ns = now_ns.saturating_sub(*arrival_ns);
        let is_ready = waited_ns >= WAIT_MIN_NS
            && self.seen.is_complete(&first.header)
            && has_load(&first.header);
        if !is_ready && waited_ns < WAIT_MAX_NS {
            return None;
        }
        let (_, first) = self.waiting.pop_front()?;
        // Lost outcomes do not come any later.
        self.seen.begin_run(first.header.run_id);
        self.seen.outcome_count = self.seen.outcome_count.max(first.header.outcome_count);
        Some(first)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }
}

impl Seen {
    fn begin_run(&mut self, run_id: u64) {
        if run_id != self.run_id {
            *self = Self { run_id, ..Self::default() };
        }
    }

    fn is_complete(&self, header: &SnapshotHeader) -> bool {
        let is_of_run = self.run_id == header.run_id;
        let has_keyframe = header.keyframe_step != header.step || self.keyframe_step >= header.step;
        is_of_run
            && self.outcome_count >= header.outcome_count
            && self.torn_count >= header.torn_count
            && has_keyframe
    }
}

#[cfg(test)]
mod tests {
    use sim_messages::{Action, Command, KeyframeHeader, Outcome, TearsHeader};

    use super::*;

    const RUN_ID: u64 = 7;

    fn snapshot(step: u64) -> SnapshotHeader {
        SnapshotHeader { run_id: RUN_ID, step, ..SnapshotHeader::default() }
    }

    fn next_step(arrivals: &mut Arrivals, now_ns: u64) -> Option<u64> {
        arrivals.next(now_ns, |_| true).map(|copied| copied.header.step)
    }

    /// Arrivals of a run whose first snapshot has passed.
    fn begun() -> Arrivals {
        let mut arrivals = Arrivals::default();
        arrivals.add(&snapshot(1), &[], 0);
        assert_eq!(next_step(&mut arrivals, WAIT_MIN_NS), Some(1));
        arrivals
    }

    #[test]
    fn a_snapshot_waits_a_moment() {
        let mut arrivals = begun();
        arrivals.add(&snapshot(2), &[ParticleState::default()], 5);
        assert_eq!(next_step(&mut arrivals, WAIT_MIN_NS + 4), None);
        let copied = arrivals.next(WAIT_MIN_NS + 5, |_| true).unwrap();
        assert_eq!((copied.header.step, copied.particles.len()), (2, 1));
        assert_eq!(next_step(&mut arrivals, WAIT_MAX_NS * 9), None);
    }

    #[test]
    fn a_snapshot_waits_for_the_outcomes_the_tears_and_the_keyframe_that_it_counts() {
        let outcome = Outcome::new(4, 2, Command::new(1, 1, Action::Reset), Ok(()));
        let outcome = Outcome { run_id: RUN_ID, ..outcome };
        let tears = TearsHeader { run_id: RUN_ID, count: 3, ..TearsHeader::default() };
        let keyframe = KeyframeHeader { run_id: RUN_ID, step: 2, ..KeyframeHeader::default() };
        let cases = [
            (SnapshotHeader { outcome_count: 5, ..snapshot(2) }, Update::Outcome(&outcome)),
            (SnapshotHeader { torn_count: 3, ..snapshot(2) }, Update::Tears(&tears, &[])),
            (SnapshotHeader { keyframe_step: 2, ..snapshot(2) }, Update::Keyframe(&keyframe, &[])),
        ];
        for (header, update) in cases {
            let mut arrivals = begun();
            arrivals.add(&header, &[], 0);
            assert_eq!(next_step(&mut arrivals, WAIT_MAX_NS - 1), None);
            arrivals.note(&update);
            assert_eq!(next_step(&mut arrivals, WAIT_MAX_NS - 1), Some(2));
        }
    }

    #[test]
    fn a_snapshot_waits_for_its_load() {
        let mut arrivals = begun();
        arrivals.add(&snapshot(2), &[], 0);
        assert!(arrivals.next(WAIT_MAX_NS - 1, |_| false).is_none());
        assert!(arrivals.next(WAIT_MIN_NS, |header| header.step == 2).is_some());
    }

    #[test]
    fn a_snapshot_waits_for_a_lost_message_only_so_long() {
        let mut arrivals = begun();
        arrivals.add(&SnapshotHeader { outcome_count: 1, ..snapshot(2) }, &[], 0);
        arrivals.add(&SnapshotHeader { outcome_count: 1, ..snapshot(3) }, &[], 0);
        assert_eq!(next_step(&mut arrivals, WAIT_MAX_NS - 1), None);
        assert_eq!(next_step(&mut arrivals, WAIT_MAX_NS), Some(2));
        // The snapshots after it lack nothing new.
        assert_eq!(next_step(&mut arrivals, WAIT_MIN_NS), Some(3));
    }
}
