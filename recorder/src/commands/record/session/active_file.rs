//! The active file: the accepted states and messages, its end, and the missing messages.

use recording::simulation::{FrozenParticles, FrozenTracker};
use recording::{
    AllCounts, CollidersRow, EnergyRow, EventRow, ForcesRow, Message, OutcomeRow, ParametersRow,
    StatusRow, StepRow, TearsRow, Topic,
};
use sim_contract::{
    Change, ColliderState, CollidersHeader, ForceRow, ForcesHeader, KeyframeHeader, LostChanges,
    NodeStatus, Outcome, ParticleState, SnapshotFlags, SnapshotHeader, State,
};

use crate::commands::record::batch::{Batch, RunEnd};
use crate::commands::record::queue::Content;
use crate::commands::record::start::FirstState;

/// The end of a file that another one may follow.
#[derive(Debug)]
pub(super) struct PreviousFile {
    pub(super) run_id: u64,
    /// Number of the next snapshot, modulo 2^32.
    next_snapshot: u32,
    /// Index of the next outcome.
    pub(super) next_outcome: u64,
    /// Number of the outcomes up to the newest state.
    outcome_count: u64,
    /// Number of the next change of the members; `None` before the first status.
    next_member_change: Option<u64>,
    /// First step of the first file of this run.
    first_step_of_run: u64,
    /// The last step to record.
    end_step: u64,
    /// Wall clock of step 0, in nanoseconds since 1970. `None` if the file belongs to an earlier run.
    epoch_ns: Option<u64>,
}

/// Missing messages between two files.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Passed {
    pub(super) states: u64,
    /// Those of runs that have ended.
    pub(super) outcomes: u64,
}

impl PreviousFile {
    /// Returns the wall clock of step 0, if this file belongs to the run of a snapshot.
    pub(super) fn epoch_ns_of(&self, first: &SnapshotHeader) -> Option<u64> {
        self.epoch_ns.filter(|_| self.run_id == first.run_id)
    }

    /// Counts a state between this file and the next one as missing.
    pub(super) fn pass(&mut self, header: &SnapshotHeader, passed: &mut Passed) {
        passed.states += self.missing_before(header) + 1;
        if self.run_id != header.run_id {
            passed.outcomes += self.passed_outcomes();
            (self.run_id, self.next_outcome, self.epoch_ns) = (header.run_id, 0, None);
            (self.next_member_change, self.first_step_of_run) = (None, header.step);
        }
        self.next_snapshot = header.snapshot_index.wrapping_add(1);
        self.outcome_count = header.outcome_count;
    }

    /// Returns the number of outcomes of its run that are missing so far.
    pub(super) fn passed_outcomes(&self) -> u64 {
        self.outcome_count.saturating_sub(self.next_outcome)
    }

    /// Returns the number of snapshots between this file and one that begins with `first`. A node
    /// numbers the snapshots of a run from 0. Those of a replay are counted as they arrive.
    fn missing_before(&self, first: &SnapshotHeader) -> u64 {
        if self.run_id == first.run_id {
            first.snapshot_index.wrapping_sub(self.next_snapshot).into()
        } else if first.flags & SnapshotFlags::REPLAY == 0 {
            first.snapshot_index.into()
        } else {
            0
        }
    }

    /// Returns the index of the next outcome that a file with this first state holds.
    fn next_outcome_of(&self, first: &SnapshotHeader) -> u64 {
        if self.run_id == first.run_id { self.next_outcome } else { first.outcome_count }
    }
}

/// The run that is being recorded.
#[derive(Debug)]
pub(super) struct ActiveFile {
    pub(super) run_id: u64,
    topology_revision: u32,
    pub(super) first_step: u64,
    /// First step of the first file of this run.
    first_step_of_run: u64,
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
    /// Step of the newest snapshot that is on its way to the file.
    written_step: Option<u64>,
    /// Number of torn constraints in the file.
    torn_count: u32,
    /// States that never arrived.
    state_gaps: u64,
    /// Number of the next list of colliders, modulo 2^32; `None` before the first.
    next_collider_list: Option<u32>,
    /// Step of the next forces; `None` before the first.
    next_forces_step: Option<u64>,
    /// Number of the next change of the members; `None` before the first status.
    next_member_change: Option<u64>,
    /// The changes that the tap dropped before the start.
    lost_before: LostChanges,
    frozen: FrozenTracker,
    counts: AllCounts,
}

impl ActiveFile {
    /// Starts before a state, which comes next.
    pub(super) fn new(
        first: &FirstState,
        previous: Option<&PreviousFile>,
        lost_before: LostChanges,
    ) -> Self {
        let FirstState { header, torn_before, .. } = first;
        let previous_of_run = previous.filter(|previous| previous.run_id == header.run_id);
        Self {
            run_id: header.run_id,
            end_step: previous.map_or(u64::MAX, |previous| previous.end_step),
            topology_revision: header.topology_revision,
            first_step: header.step,
            first_step_of_run: previous_of_run
                .map_or(header.step, |previous| previous.first_step_of_run),
            last: *header,
            next_snapshot: header.snapshot_index,
            // Earlier outcomes are part of the first state, or in the file before.
            next_outcome: previous
                .map_or(header.outcome_count, |previous| previous.next_outcome_of(header)),
            keyframe_step: 0,
            recorded_keyframe_step: None,
            written_step: None,
            torn_count: u32::try_from(torn_before.len()).unwrap_or(u32::MAX),
            state_gaps: previous.map_or(0, |previous| previous.missing_before(header)),
            next_collider_list: None,
            next_forces_step: None,
            next_member_change: previous_of_run.and_then(|previous| previous.next_member_change),
            lost_before,
            frozen: FrozenTracker::default(),
            counts: AllCounts::default(),
        }
    }

    /// Returns the last recorded state.
    pub(super) fn last(&self) -> &SnapshotHeader {
        &self.last
    }

    /// Adds snapshots and outcomes that are missing before the first ones.
    pub(super) fn add_gaps(&mut self, states: u64, outcomes: u64) {
        self.state_gaps += states;
        self.counts[Topic::Outcomes].gaps += outcomes;
    }

    /// Ends the recording a number of steps after the first one.
    pub(super) fn set_steps_max(&mut self, steps_max: Option<u64>) {
        let end_step = steps_max.map(|steps| self.first_step.saturating_add(steps));
        self.end_step = end_step.unwrap_or(u64::MAX);
    }

    /// Ends the file.
    pub(super) fn into_previous(self, epoch_ns: u64) -> PreviousFile {
        let next_outcome = self.next_outcome.max(self.last.outcome_count);
        PreviousFile {
            run_id: self.run_id,
            next_snapshot: self.next_snapshot,
            next_outcome,
            outcome_count: next_outcome,
            next_member_change: self.next_member_change,
            first_step_of_run: self.first_step_of_run,
            end_step: self.end_step,
            epoch_ns: Some(epoch_ns),
        }
    }

    /// Accepts the changes between the last state and the first one of the next file. The changes in
    /// the step of that one are part of it, except its events.
    pub(super) fn accept_changes_before(&mut self, next: &State<'_>, batch: &mut Batch) {
        if next.header.run_id != self.run_id {
            return;
        }
        let changes = next.changes.iter().filter(|change| is_before(change, next.header.step));
        let mut rows: Vec<_> = changes.filter_map(|change| self.row(change)).collect();
        if next.header.topology_revision == self.topology_revision {
            let events =
                self.frozen.new_events(next.header.step, FrozenParticles::find(next.particles));
            rows.extend(events.into_iter().map(Message::Event));
        }
        for message in rows {
            self.push(message, batch);
        }
    }

    /// Adds a row. One that describes a state whose snapshot is written has come too late, as over a tunnel, and counts as
    /// missing: the messages of a file are in the order of steps.
    fn push(&mut self, message: Message, batch: &mut Batch) {
        let topic = message.topic();
        if topic.is_of_state() && self.written_step >= Some(message.step()) {
            self.counts[topic].gaps += 1;
        } else {
            self.counts[topic].received += 1;
            batch.push(message);
        }
    }

    /// Marks all accepted snapshots as written.
    pub(super) fn mark_written(&mut self) {
        if self.counts[Topic::Steps].received > 0 {
            self.written_step = Some(self.last.step);
        }
    }

    /// Counts the rows of the load.
    pub(super) fn count_load(&mut self, rows: &[Message]) {
        for row in rows {
            self.counts[row.topic()].received += 1;
        }
    }

    /// Accepts a state, its energy if it was asked for, and the changes before it, unless the recording ends before it.
    pub(super) fn accept(
        &mut self,
        (header, energy): (&SnapshotHeader, Option<EnergyRow>),
        particles: &[ParticleState],
        changes: &[Change],
        batch: &mut Batch,
    ) {
        batch.end = self.end_at(header);
        if batch.end.is_some() {
            return;
        }
        let rows = changes.iter().filter_map(|change| self.row(change));
        let rows: Vec<_> = rows.collect();
        let mut buffer = std::mem::take(&mut batch.spare);
        buffer.copy_from(particles);
        let frozen = FrozenParticles::find(buffer.particles());
        let events = self.frozen.new_events(header.step, frozen);
        for message in rows.into_iter().chain(events.into_iter().map(Message::Event)) {
            self.push(message, batch);
        }
        self.count_gaps(header);
        self.last = *header;
        self.counts[Topic::Steps].received += 1;
        self.counts[Topic::Particles].received += 1;
        let row = StepRow { energy, ..StepRow::from(header) };
        batch.contents.push(Content::Snapshot(row, buffer));
        if header.step >= self.end_step {
            batch.end = Some(RunEnd::EndStep);
        }
    }

    /// Returns the reason why the file ends before a state.
    pub(super) fn end_at(&self, header: &SnapshotHeader) -> Option<RunEnd> {
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
            Change::Parameters(header, values) => Some(Message::Parameters(ParametersRow {
                step: header.step,
                values: values.clone(),
            })),
            Change::Forces(header, rows) => self.forces_row(header, rows),
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

    /// Returns the row of forces, unless they precede the file.
    fn forces_row(&mut self, header: &ForcesHeader, rows: &[ForceRow]) -> Option<Message> {
        let ForcesHeader { step, .. } = *header;
        // An owner publishes those of each step. A replay lacks those that its recording lacks.
        let is_replay = self.last.flags & SnapshotFlags::REPLAY != 0;
        let missing = step.saturating_sub(self.next_forces_step.unwrap_or(step));
        self.next_forces_step = Some(step + 1);
        let row = ForcesRow::new(step, rows);
        let gaps = if is_replay { 0 } else { missing };
        self.counts[Topic::Forces].gaps += gaps + u64::from(row.is_none());
        row.filter(|row| row.step >= self.first_step).map(Message::Forces)
    }

    /// Returns the row of a keyframe, unless it is in the file, or belongs to a snapshot that is. A paused node publishes
    /// the keyframe of its state for a new reader.
    fn keyframe_row(&mut self, header: &KeyframeHeader, bytes: &[u8]) -> Option<Message> {
        let step = header.step;
        if step < self.first_step || self.recorded_keyframe_step >= Some(step) {
            return None;
        }
        self.recorded_keyframe_step = Some(step);
        let is_late = self.written_step >= Some(step);
        (!is_late).then(|| Message::Keyframe { step, bytes: bytes.to_vec() })
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
        batch: &mut Batch,
    ) {
        for outcome in outcomes {
            let is_later = batch.end.is_some() && outcome.index >= self.last.outcome_count
                || outcome.step > self.end_step;
            let is_foreign = outcome.run_id != self.run_id || is_later;
            if is_foreign || outcome.index < self.next_outcome {
                continue;
            }
            self.counts[Topic::Outcomes].gaps += outcome.index - self.next_outcome;
            self.next_outcome = outcome.index.saturating_add(1);
            self.push(Message::Outcome(OutcomeRow::from(&outcome)), batch);
        }
    }

    pub(super) fn accept_statuses(&mut self, statuses: &[NodeStatus], batch: &mut Batch) {
        let steps = self.first_step..=self.end_step;
        for status in statuses {
            if status.run_id != self.run_id {
                continue;
            }
            self.accept_member_changes(status, batch);
            if steps.contains(&status.step) {
                self.counts[Topic::Status].received += 1;
                batch.push(Message::Status(StatusRow::from(status)));
            }
        }
    }

    /// Leaves out the changes of the members that precede the recording.
    pub(super) fn skip_member_changes(&mut self, status: Option<&NodeStatus>) {
        let status = status.filter(|status| status.run_id == self.run_id);
        let count = status.map(|status| status.member_changes.count);
        self.next_member_change = self.next_member_change.or(count);
    }

    /// Accepts the changes of the members that no status before has named. Those between the file before
    /// and this one are in neither, and missing.
    fn accept_member_changes(&mut self, status: &NodeStatus, batch: &mut Batch) {
        let changes = &status.member_changes;
        let next = self.next_member_change.unwrap_or(changes.oldest());
        self.counts[Topic::Events].gaps += changes.oldest().saturating_sub(next);
        self.next_member_change = Some(changes.count.max(next));
        let steps_before = self.first_step_of_run..self.first_step;
        let between = changes.iter_from(next).filter(|one| steps_before.contains(&one.step));
        self.counts[Topic::Events].gaps += between.count() as u64;
        let steps = self.first_step..=self.end_step;
        for change in changes.iter_from(next).filter(|change| steps.contains(&change.step)) {
            self.counts[Topic::Events].received += 1;
            batch.push(Message::Event(EventRow::from(change)));
        }
    }

    /// Returns the numbers of received and missing messages.
    pub(super) fn counts(&self, lost: &LostChanges) -> AllCounts {
        let mut counts = self.counts;
        counts[Topic::Particles].gaps = self.state_gaps;
        counts[Topic::Steps].gaps = self.state_gaps;
        counts[Topic::Outcomes].gaps += self.last.outcome_count.saturating_sub(self.next_outcome);
        counts[Topic::Tears].gaps +=
            u64::from(self.last.torn_count.saturating_sub(self.torn_count));
        counts[Topic::Parameters].gaps = lost.parameters - self.lost_before.parameters;
        counts
    }
}

/// Returns `true` for a row of a step before `step`.
fn is_before(change: &Change, step: u64) -> bool {
    match change {
        Change::Load | Change::Outcome(_) => false,
        Change::Colliders(header, _) => header.step < step,
        Change::Tears(header, _) => header.step < step,
        Change::Parameters(header, _) => header.step < step,
        Change::Forces(header, _) => header.step < step,
        Change::Keyframe(header, _) => header.step < step,
    }
}
