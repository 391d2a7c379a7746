//! The run in progress: the accepted states and messages, the end, and the missing messages.

use recorder::{
    AllCounts, CollidersRow, EventRow, Message, OutcomeRow, ParametersRow, StatusRow, StepRow,
    TearsRow, Topic,
};
use sim_contract::{
    Change, ColliderState, CollidersHeader, KeyframeHeader, LostChanges, NodeStatus, Outcome,
    ParticleState, SnapshotHeader,
};

use crate::commands::record::accepted::{Accepted, RunEnd};
use crate::commands::record::first_state::FirstState;
use crate::commands::record::queue::Content;
use crate::simulation::frozen::FrozenTracker;

/// The run that is being recorded.
#[derive(Debug)]
pub(super) struct Started {
    run_id: u64,
    topology_revision: u32,
    pub(super) first_step: u64,
    /// The last step to record.
    end_step: u64,
    /// The last recorded state.
    last: SnapshotHeader,
    /// Number of the next snapshot, modulo 2^32.
    next_snapshot: u32,
    next_outcome: u64,
    /// Step of the newest keyframe that a state refers to.
    keyframe_step: u64,
    /// Step of the newest keyframe in the file.
    recorded_keyframe_step: Option<u64>,
    /// Number of torn constraints in the file.
    torn_count: u32,
    /// States that never arrived.
    state_gaps: u64,
    /// Number of the next list of colliders, modulo 2^32; `None` before the first.
    next_collider_list: Option<u32>,
    /// Number of the next change of the members; `None` before the first status.
    next_member_change: Option<u64>,
    /// The changes that the tap dropped before the start.
    lost_before: LostChanges,
    frozen: FrozenTracker,
    counts: AllCounts,
}

impl Started {
    /// Starts before a state, which comes next.
    pub(super) fn new(
        first: &FirstState,
        steps_max: Option<u64>,
        lost_before: LostChanges,
    ) -> Self {
        let FirstState { header, torn_before, .. } = first;
        Self {
            run_id: header.run_id,
            end_step: steps_max.map_or(u64::MAX, |steps| header.step.saturating_add(steps)),
            topology_revision: header.topology_revision,
            first_step: header.step,
            last: *header,
            next_snapshot: header.snapshot_index,
            // Earlier outcomes are part of the first state.
            next_outcome: header.outcome_count,
            keyframe_step: 0,
            recorded_keyframe_step: None,
            torn_count: u32::try_from(torn_before.len()).unwrap_or(u32::MAX),
            state_gaps: 0,
            next_collider_list: None,
            next_member_change: None,
            lost_before,
            frozen: FrozenTracker::default(),
            counts: AllCounts::default(),
        }
    }

    /// Counts the rows of the load.
    pub(super) fn count_load(&mut self, rows: &[Message]) {
        for row in rows {
            self.counts[row.topic()].received += 1;
        }
    }

    /// Accepts a state and the changes before it, unless the recording ends before it.
    pub(super) fn accept(
        &mut self,
        header: &SnapshotHeader,
        particles: Vec<ParticleState>,
        changes: &[Change],
        accepted: &mut Accepted,
    ) {
        accepted.end = self.end_at(header);
        if accepted.end.is_some() {
            return;
        }
        let rows = changes.iter().filter_map(|change| self.row(change));
        let rows: Vec<_> = rows.collect();
        let events = self.frozen.new_events(header.step, &particles);
        for message in rows.into_iter().chain(events.into_iter().map(Message::Event)) {
            self.counts[message.topic()].received += 1;
            accepted.push(message);
        }
        self.count_gaps(header);
        self.last = *header;
        self.counts[Topic::Steps].received += 1;
        self.counts[Topic::Particles].received += 1;
        accepted.contents.push(Content::Snapshot(StepRow::from(header), particles));
        if header.step >= self.end_step {
            accepted.end = Some(RunEnd::EndStep);
        }
    }

    fn end_at(&self, header: &SnapshotHeader) -> Option<RunEnd> {
        if header.run_id != self.run_id {
            Some(RunEnd::NewRun)
        } else if header.topology_revision != self.topology_revision {
            Some(RunEnd::NewLoad)
        } else if header.step > self.end_step {
            Some(RunEnd::EndStep)
        } else {
            None
        }
    }

    /// Returns the row of a change, if it has one. Outcomes are recorded as they arrive.
    fn row(&mut self, change: &Change) -> Option<Message> {
        match change {
            Change::Load | Change::Outcome(_) => None,
            Change::Colliders(header, list) => self.colliders_row(header, list),
            Change::Tears(header, new) => {
                self.torn_count = header.count;
                (!new.is_empty()).then(|| Message::Tears(TearsRow::new(header.step, new)))
            }
            Change::Parameters(header, values) => {
                Some(Message::Parameters(ParametersRow { step: header.step, values: *values }))
            }
            Change::Keyframe(header, bytes) => self.keyframe_row(header, bytes),
        }
    }

    /// Returns the row of a list of colliders. A scene without colliders has no rows.
    fn colliders_row(
        &mut self,
        header: &CollidersHeader,
        list: &[ColliderState],
    ) -> Option<Message> {
        let CollidersHeader { step, list_index, .. } = *header;
        let missing = list_index.wrapping_sub(self.next_collider_list.unwrap_or(list_index));
        self.next_collider_list = Some(list_index.wrapping_add(1));
        let row = CollidersRow::new(step, list);
        // A collider of an unknown shape cannot be recorded.
        self.counts[Topic::Colliders].gaps += u64::from(missing) + u64::from(row.is_none());
        row.filter(|row| !row.colliders.is_empty()).map(Message::Colliders)
    }

    /// Returns the row of a keyframe, unless it is in the file. The first one may arrive twice: after
    /// its state, and with the next one.
    fn keyframe_row(&mut self, header: &KeyframeHeader, bytes: &[u8]) -> Option<Message> {
        let step = header.step;
        let is_new = step >= self.first_step && self.recorded_keyframe_step < Some(step);
        is_new.then(|| {
            self.recorded_keyframe_step = Some(step);
            Message::Keyframe { step, bytes: bytes.to_vec() }
        })
    }

    /// Counts the states and keyframes that are missing before a state.
    fn count_gaps(&mut self, header: &SnapshotHeader) {
        self.state_gaps += u64::from(header.snapshot_index.wrapping_sub(self.next_snapshot));
        self.next_snapshot = header.snapshot_index.wrapping_add(1);
        if header.keyframe_step > self.keyframe_step && header.keyframe_step >= self.first_step {
            self.keyframe_step = header.keyframe_step;
            let is_missing = self.recorded_keyframe_step < Some(header.keyframe_step);
            self.counts[Topic::Keyframe].gaps += u64::from(is_missing);
        }
    }

    /// Accepts the outcomes of this run. After its end these are the ones that the last state counts.
    pub(super) fn accept_outcomes(
        &mut self,
        outcomes: impl Iterator<Item = Outcome>,
        accepted: &mut Accepted,
    ) {
        for outcome in outcomes {
            let is_later = accepted.end.is_some() && outcome.index >= self.last.outcome_count
                || outcome.step > self.end_step;
            let is_foreign = outcome.run_id != self.run_id || is_later;
            if is_foreign || outcome.index < self.next_outcome {
                continue;
            }
            self.counts[Topic::Outcomes].gaps += outcome.index - self.next_outcome;
            self.counts[Topic::Outcomes].received += 1;
            self.next_outcome = outcome.index.saturating_add(1);
            accepted.push(Message::Outcome(OutcomeRow::from(&outcome)));
        }
    }

    pub(super) fn accept_statuses(&mut self, statuses: &[NodeStatus], accepted: &mut Accepted) {
        let steps = self.first_step..=self.end_step;
        for status in statuses {
            if status.run_id != self.run_id {
                continue;
            }
            self.accept_member_changes(status, accepted);
            if steps.contains(&status.step) {
                self.counts[Topic::Status].received += 1;
                accepted.push(Message::Status(StatusRow::from(status)));
            }
        }
    }

    /// Leaves out the changes of the members that precede the recording.
    pub(super) fn skip_member_changes(&mut self, status: Option<&NodeStatus>) {
        let status = status.filter(|status| status.run_id == self.run_id);
        self.next_member_change = status.map(|status| status.member_changes.count);
    }

    /// Accepts the changes of the members that no status before has named.
    fn accept_member_changes(&mut self, status: &NodeStatus, accepted: &mut Accepted) {
        let changes = &status.member_changes;
        let next = self.next_member_change.unwrap_or(changes.oldest());
        self.counts[Topic::Events].gaps += changes.oldest().saturating_sub(next);
        self.next_member_change = Some(changes.count.max(next));
        let steps = self.first_step..=self.end_step;
        for change in changes.iter_from(next).filter(|change| steps.contains(&change.step)) {
            self.counts[Topic::Events].received += 1;
            accepted.push(Message::Event(EventRow::from(change)));
        }
    }

    /// Returns the numbers of received and missing messages.
    pub(super) fn counts(&self, lost: &LostChanges) -> AllCounts {
        let mut counts = self.counts;
        counts[Topic::Particles].gaps = self.state_gaps;
        counts[Topic::Steps].gaps = self.state_gaps;
        counts[Topic::Outcomes].gaps += self.last.outcome_count.saturating_sub(self.next_outcome);
        counts[Topic::Tears].gaps = u64::from(self.last.torn_count.saturating_sub(self.torn_count));
        counts[Topic::Parameters].gaps = lost.parameters - self.lost_before.parameters;
        counts
    }
}
