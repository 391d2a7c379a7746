//! The run that is being recorded: what is accepted out of each batch, in which order, and until when.

use std::collections::{BTreeMap, BTreeSet};

use recorder::{AllCounts, Message, OutcomeRow, StepRow, Topic};
use sim_contract::SnapshotHeader;

use crate::commands::record::accepted::{Accepted, RunEnd};
use crate::commands::record::batch::{Batch, Snapshot};
use crate::commands::record::collider_log::ColliderLog;
use crate::commands::record::queue::Content;
use crate::commands::record::tear_log::TearLog;
use crate::simulation::frozen::FrozenTracker;

/// The run that is being recorded.
#[derive(Debug)]
pub(super) struct Started {
    run_id: u64,
    topology_revision: u32,
    pub(super) first_step: u64,
    /// The last step that is wanted.
    end_step: u64,
    last: SnapshotHeader,
    next_outcome: u64,
    /// The newest keyframe that a snapshot named.
    named_keyframe: u64,
    /// Steps of the keyframes that came, above the one named last.
    keyframes: BTreeSet<u64>,
    /// How often each distance between two snapshots occurred, in steps.
    distances: BTreeMap<u64, u64>,
    tears: TearLog,
    colliders: ColliderLog,
    frozen: FrozenTracker,
}

impl Started {
    /// `tears` and `colliders` have begun with the first snapshot.
    pub(super) fn new(
        first: &SnapshotHeader,
        steps_max: Option<u64>,
        tears: TearLog,
        colliders: ColliderLog,
    ) -> Self {
        Self {
            run_id: first.run_id,
            end_step: steps_max.map_or(u64::MAX, |steps| first.step.saturating_add(steps)),
            topology_revision: first.topology_revision,
            first_step: first.step,
            last: *first,
            // Those before are part of the first state.
            next_outcome: first.outcome_count,
            named_keyframe: 0,
            keyframes: BTreeSet::new(),
            distances: BTreeMap::new(),
            tears,
            colliders,
            frozen: FrozenTracker::default(),
        }
    }

    /// Takes in a batch; what belongs together comes out in the order of publication.
    pub(super) fn accept(&mut self, batch: Batch, counts: &mut AllCounts, accepted: &mut Accepted) {
        self.tears.add(batch.tears, batch.tear_causes);
        self.colliders.add(batch.colliders);
        let (run_id, wanted) = (self.run_id, self.first_step..=self.end_step);
        let keyframes = batch
            .keyframes
            .into_iter()
            .filter(|(header, _)| header.run_id == run_id && wanted.contains(&header.step));
        let keyframes: Vec<_> = keyframes
            .map(|(header, bytes)| Message::Keyframe { step: header.step, bytes })
            .collect();
        self.keyframes.extend(keyframes.iter().map(Message::step));
        let mut arrived = self.take_snapshots(batch.snapshots, counts, accepted);
        let outcomes = self.take_outcomes(batch.outcomes, accepted.end, counts);
        let updates = batch.updates.into_iter().filter(|(of, _)| *of == run_id);
        let updates = updates.map(|(_, update)| update).filter(|one| wanted.contains(&one.step()));
        let lists = self.take_lists(&outcomes);
        for update in updates.chain(keyframes).chain(outcomes).chain(lists) {
            counts[update.topic()].received += 1;
            arrived.push(Content::Update(update));
        }
        arrived.sort_by_key(place);
        accepted.contents.append(&mut arrived);
    }

    /// Takes the snapshots up to the end, and what they show that was not told.
    fn take_snapshots(
        &mut self,
        snapshots: Vec<Snapshot>,
        counts: &mut AllCounts,
        accepted: &mut Accepted,
    ) -> Vec<Content> {
        let mut arrived = Vec::new();
        for snapshot in snapshots {
            accepted.end = self.end_at(&snapshot.header);
            if accepted.end.is_some() {
                break;
            }
            for event in self.frozen.new_events(snapshot.header.step, &snapshot.particles) {
                counts[Topic::Events].received += 1;
                arrived.push(Content::Update(Message::Event(event)));
            }
            arrived.push(self.take_snapshot(snapshot, counts));
        }
        if accepted.end.is_none() && self.last.step >= self.end_step {
            accepted.end = Some(RunEnd::EndStep);
        }
        arrived
    }

    /// What tore and where colliders were, up to the last snapshot.
    fn take_lists(&mut self, outcomes: &[Message]) -> Vec<Message> {
        for step in outcomes.iter().filter_map(Message::reset_step) {
            self.tears.add_reset(step);
        }
        let colliders = self.colliders.rows_until(&self.last).into_iter().map(Message::Colliders);
        let tears = self.tears.rows_until(&self.last).into_iter().map(Message::Tears);
        colliders.chain(tears).collect()
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

    fn take_snapshot(&mut self, snapshot: Snapshot, counts: &mut AllCounts) -> Content {
        let Snapshot { header, particles } = snapshot;
        let distance = header.step.saturating_sub(self.last.step);
        if distance > 0 {
            *self.distances.entry(distance).or_default() += 1;
        }
        let named = header.keyframe_step;
        if named > self.named_keyframe && named >= self.first_step {
            self.named_keyframe = named;
            // A keyframe is published before the snapshots that name it, and was read after them.
            let is_missing = !self.keyframes.contains(&named);
            counts[Topic::Keyframe].gaps += u64::from(is_missing);
            self.keyframes = self.keyframes.split_off(&named);
        }
        self.last = header;
        counts[Topic::Steps].received += 1;
        counts[Topic::Particles].received += 1;
        Content::Snapshot(StepRow::from(&header), particles)
    }

    /// Once another run has begun, only those that the last snapshot counts are of this one.
    fn take_outcomes(
        &mut self,
        outcomes: Vec<OutcomeRow>,
        end: Option<RunEnd>,
        counts: &mut AllCounts,
    ) -> Vec<Message> {
        let mut kept = Vec::new();
        for row in outcomes {
            let is_foreign =
                end.is_some() && row.index >= self.last.outcome_count || row.step > self.end_step;
            if row.index < self.next_outcome || is_foreign {
                continue;
            }
            counts[Topic::Outcomes].gaps += row.index - self.next_outcome;
            self.next_outcome = row.index + 1;
            kept.push(Message::Outcome(row));
        }
        kept
    }

    /// Adds what is missing at the end of what was accepted in.
    pub(super) fn add_gaps(&self, counts: &mut AllCounts) {
        let snapshots = self.snapshot_gaps();
        counts[Topic::Particles].gaps = snapshots;
        counts[Topic::Steps].gaps = snapshots;
        counts[Topic::Outcomes].gaps += self.last.outcome_count.saturating_sub(self.next_outcome);
        counts[Topic::Tears].gaps = self.tears.missing_count(&self.last);
        counts[Topic::Colliders].gaps = self.colliders.lost_count();
    }

    /// Snapshots that never came. A node publishes every k-th step, and k is the smallest distance
    /// that occurred.
    fn snapshot_gaps(&self) -> u64 {
        let Some((stride, _)) = self.distances.first_key_value() else { return 0 };
        self.distances.iter().map(|(distance, count)| (distance / stride - 1) * count).sum()
    }
}

/// By step, then in the order of publication.
fn place(content: &Content) -> (u64, Topic) {
    match content {
        Content::Update(message) => (message.step(), message.topic()),
        Content::Snapshot(row, _) => (row.step, Topic::Steps),
    }
}
