//! The run in progress: the accepted messages of each batch, their order, and the end.

use std::collections::BTreeSet;

use recorder::{AllCounts, Message, OutcomeRow, StepRow, Topic};
use sim_contract::SnapshotHeader;

use crate::commands::record::accepted::{Accepted, RunEnd};
use crate::commands::record::batch::{Batch, Snapshot};
use crate::commands::record::lists::Lists;
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
    last: SnapshotHeader,
    next_outcome: u64,
    /// The newest keyframe that a snapshot refers to.
    keyframe_step: u64,
    /// Steps of the keyframes that arrived, from that one on.
    keyframes: BTreeSet<u64>,
    /// Snapshots that never arrived.
    snapshot_gaps: u64,
    lists: Lists,
    frozen: FrozenTracker,
}

impl Started {
    /// `lists` have started with the first snapshot.
    pub(super) fn new(first: &SnapshotHeader, steps_max: Option<u64>, lists: Lists) -> Self {
        Self {
            run_id: first.run_id,
            end_step: steps_max.map_or(u64::MAX, |steps| first.step.saturating_add(steps)),
            topology_revision: first.topology_revision,
            first_step: first.step,
            last: *first,
            // Earlier outcomes are part of the first state.
            next_outcome: first.outcome_count,
            keyframe_step: 0,
            keyframes: BTreeSet::new(),
            snapshot_gaps: 0,
            lists,
            frozen: FrozenTracker::default(),
        }
    }

    /// Accepts a batch and sorts it in the order of publication.
    pub(super) fn accept(
        &mut self,
        mut batch: Batch,
        counts: &mut AllCounts,
        accepted: &mut Accepted,
    ) {
        self.lists.add(&mut batch);
        let (run_id, steps) = (self.run_id, self.first_step..=self.end_step);
        let keyframes = batch
            .keyframes
            .into_iter()
            .filter(|(header, _)| header.run_id == run_id && steps.contains(&header.step));
        let keyframes: Vec<_> = keyframes
            .map(|(header, bytes)| Message::Keyframe { step: header.step, bytes })
            .collect();
        self.keyframes.extend(keyframes.iter().map(Message::step));
        let mut contents = self.accept_snapshots(batch.snapshots, counts, accepted);
        let outcomes = self.accept_outcomes(batch.outcomes, accepted.end, counts);
        let statuses = batch.statuses.into_iter();
        let statuses = statuses.filter(|one| one.run_id == run_id && steps.contains(&one.step));
        let statuses = statuses.map(|one| one.row);
        let rows = self.lists.rows_until(&self.last);
        for update in statuses.chain(keyframes).chain(outcomes).chain(rows) {
            counts[update.topic()].received += 1;
            contents.push(Content::Update(update));
        }
        contents.sort_by_key(order);
        accepted.contents.append(&mut contents);
    }

    /// Accepts the snapshots up to the end, with the events that they show.
    fn accept_snapshots(
        &mut self,
        snapshots: Vec<Snapshot>,
        counts: &mut AllCounts,
        accepted: &mut Accepted,
    ) -> Vec<Content> {
        let mut contents = Vec::new();
        for snapshot in snapshots {
            accepted.end = self.end_at(&snapshot.header);
            if accepted.end.is_some() {
                break;
            }
            for event in self.frozen.new_events(snapshot.header.step, &snapshot.particles) {
                counts[Topic::Events].received += 1;
                contents.push(Content::Update(Message::Event(event)));
            }
            contents.push(self.accept_snapshot(snapshot, counts));
        }
        if accepted.end.is_none() && self.last.step >= self.end_step {
            accepted.end = Some(RunEnd::EndStep);
        }
        contents
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

    fn accept_snapshot(&mut self, snapshot: Snapshot, counts: &mut AllCounts) -> Content {
        let Snapshot { header, particles } = snapshot;
        // A node that pauses also publishes the step before the pause, so the distance may be less
        // than the stride.
        let distance = header.step.saturating_sub(self.last.step);
        let stride = u64::from(header.stride.max(1));
        self.snapshot_gaps += distance.div_ceil(stride).saturating_sub(1);
        let keyframe_step = header.keyframe_step;
        if keyframe_step > self.keyframe_step && keyframe_step >= self.first_step {
            self.keyframe_step = keyframe_step;
            // A keyframe is published before the snapshots that refer to it, and read after them.
            let is_missing = !self.keyframes.contains(&keyframe_step);
            counts[Topic::Keyframe].gaps += u64::from(is_missing);
            self.keyframes = self.keyframes.split_off(&keyframe_step);
        }
        self.last = header;
        counts[Topic::Steps].received += 1;
        counts[Topic::Particles].received += 1;
        Content::Snapshot(StepRow::from(&header), particles)
    }

    /// Accepts the outcomes of this run. After its end these are the ones that the last snapshot
    /// counts.
    fn accept_outcomes(
        &mut self,
        outcomes: Vec<OutcomeRow>,
        end: Option<RunEnd>,
        counts: &mut AllCounts,
    ) -> Vec<Message> {
        let mut accepted = Vec::new();
        for row in outcomes {
            let is_foreign =
                end.is_some() && row.index >= self.last.outcome_count || row.step > self.end_step;
            if row.index < self.next_outcome || is_foreign {
                continue;
            }
            counts[Topic::Outcomes].gaps += row.index - self.next_outcome;
            self.next_outcome = row.index + 1;
            accepted.push(Message::Outcome(row));
        }
        accepted
    }

    /// Adds the messages that are still missing.
    pub(super) fn add_gaps(&self, counts: &mut AllCounts) {
        counts[Topic::Particles].gaps = self.snapshot_gaps;
        counts[Topic::Steps].gaps = self.snapshot_gaps;
        counts[Topic::Outcomes].gaps += self.last.outcome_count.saturating_sub(self.next_outcome);
        self.lists.add_gaps(&self.last, counts);
    }
}

/// Returns the sort key: the step, then the order of publication.
fn order(content: &Content) -> (u64, Topic) {
    match content {
        Content::Update(message) => (message.step(), message.topic()),
        Content::Snapshot(row, _) => (row.step, Topic::Steps),
    }
}
