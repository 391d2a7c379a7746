//! Selects the states and messages of a recording: its start, its end, and the missing messages.

mod active_file;

use recording::{AllCounts, Closing, EnergyRow, Topic};
use sim_contract::{
    Change, LostChanges, NodeStatus, Outcome, ReadError, SnapshotFlags, SnapshotHeader, State,
};
use sim_solver::EnergyMeter;

use super::batch::{Batch, Messages, RunEnd};
use super::start::{FirstState, Load, LoadError, Now};
use active_file::{ActiveFile, Passed, PreviousFile};

/// Most outcomes to keep before the first state. Beyond it the oldest are dropped.
const OUTCOMES_PENDING_MAX: usize = 1 << 16;

/// Accepts a run from the first state that has its keyframe, in one file or in several that follow each
/// other.
#[derive(Debug, Default)]
pub(crate) struct Session {
    /// Steps to record after the first one.
    steps_max: Option<u64>,
    /// The load of the newest state.
    load: Option<Load>,
    /// The newest state, until its keyframe arrives. A paused node publishes it after the state.
    candidate: Option<FirstState>,
    /// The newest status, until the recording starts.
    status: Option<NodeStatus>,
    /// Outcomes that may follow the first state.
    outcomes: Vec<Outcome>,
    active: Option<ActiveFile>,
    /// The file before this one.
    previous: Option<PreviousFile>,
    /// The newest replayed run whose first snapshot has arrived.
    seen_replay: Option<u64>,
    /// Snapshots of replayed runs that have arrived from the first on, and before the first state of the next
    /// file.
    skipped: Skipped,
    /// The number of these snapshots before all files.
    skipped_count: u64,
    lost: LostChanges,
    /// The disk stalls, so no file begins.
    is_delayed: bool,
    /// States and outcomes since the last file, between which no file could begin.
    passed: Passed,
    /// Messages after the first state or the candidate that arrived but could not be read.
    unreadable: u64,
    /// The candidate or first state is new, and the errors of the messages before it have not been added.
    follows_errors: bool,
    /// An error was reported, and the recording had started then.
    reported: Option<bool>,
    has_energy: bool,
    /// Measures the states of the load, if it was asked for.
    meter: Option<EnergyMeter>,
}

/// Returns the energy of a state, if it was asked for. A state whose tears or parameters have not arrived has none.
fn measure(meter: &mut Option<EnergyMeter>, state: &State<'_>) -> Option<EnergyRow> {
    let State { header, torn, parameters, .. } = *state;
    let has_parts = torn.header.run_id == header.run_id
        && torn.constraints.len() == header.torn_count as usize
        && parameters.header.run_id == header.run_id;
    if !has_parts {
        return None;
    }
    let (particles, torn) = (bytemuck::cast_slice(state.particles), state.torn.indices());
    meter.as_mut()?.measure(particles, torn, &state.parameters.values).map(EnergyRow::from)
}

/// Snapshots that came before the first one that has its keyframe.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Skipped {
    pub(crate) count: u64,
    /// Step of the last one.
    pub(crate) last_step: u64,
}

impl Session {
    /// Accepts up to `steps_max` steps after the first one.
    pub(crate) fn new(steps_max: Option<u64>) -> Self {
        Self { steps_max, ..Self::default() }
    }

    /// Measures the energy of each state.
    pub(crate) fn with_energy(self, has_energy: bool) -> Self {
        Self { has_energy, ..self }
    }

    /// Accepts the next state of a tap.
    pub(crate) fn accept_state(
        &mut self,
        state: &State<'_>,
        now: Now,
        batch: &mut Batch,
    ) -> Result<(), LoadError> {
        for change in state.changes {
            if let Change::Keyframe(header, bytes) = change
                && let Some(candidate) = &mut self.candidate
            {
                candidate.add_keyframe(header, bytes);
            }
        }
        self.start_if_ready(now, batch);
        if let Some(active) = &mut self.active {
            let energy = measure(&mut self.meter, state);
            let particles = state.particles;
            active.accept((state.header, energy), particles, state.changes, batch);
            return Ok(());
        }
        if matches!(state.changes.first(), Some(Change::Load)) {
            let load = Load::new(state.load)?;
            self.meter = self.has_energy.then(|| load.energy_meter());
            self.load = Some(load);
        }
        let first_outcome = self.first_outcome(state.header);
        self.outcomes.retain(|outcome| {
            outcome.run_id != state.header.run_id || outcome.index >= first_outcome
        });
        self.skip_candidate();
        if self.is_delayed {
            self.candidate = None;
            if let Some(previous) = &mut self.previous {
                previous.pass(state.header, &mut self.passed);
            }
            return Ok(());
        }
        if state.header.snapshot_index == 0 && is_replay(state.header) {
            self.seen_replay = Some(state.header.run_id);
        }
        let energy = measure(&mut self.meter, state);
        self.candidate = FirstState::new(state).map(|first| FirstState { energy, ..first });
        if self.previous.is_none() {
            (self.unreadable, self.follows_errors) = (0, true);
        }
        self.start_if_ready(now, batch);
        Ok(())
    }

    /// Accepts the messages that have arrived between states.
    pub(crate) fn accept_messages(&mut self, messages: Messages, now: Now, batch: &mut Batch) {
        if let Some(candidate) = &mut self.candidate {
            for (header, bytes) in &messages.keyframes {
                candidate.add_keyframe(header, bytes);
            }
            self.start_if_ready(now, batch);
        }
        self.outcomes.extend(messages.outcomes);
        let Some(active) = &mut self.active else {
            let excess = self.outcomes.len().saturating_sub(OUTCOMES_PENDING_MAX);
            self.outcomes.drain(..excess);
            self.status = messages.statuses.last().copied().or(self.status);
            return;
        };
        // Those of later steps follow with their states.
        let next_step = active.last().step + 1;
        let is_due = |one: &mut Outcome| one.run_id != active.run_id || one.step <= next_step;
        let due: Vec<_> = self.outcomes.extract_if(.., is_due).collect();
        active.accept_outcomes(due.into_iter(), batch);
        active.accept_statuses(&messages.statuses, batch);
    }

    /// Returns the index of the first outcome that a file with this first state holds. Earlier ones are
    /// part of the state, or in the file before.
    fn first_outcome(&self, first: &SnapshotHeader) -> u64 {
        let previous = self.previous.as_ref().filter(|previous| previous.run_id == first.run_id);
        previous.map_or(first.outcome_count, |previous| previous.next_outcome)
    }

    /// Counts the candidate, whose keyframe has not arrived, if it belongs to a replayed run that was there to
    /// be recorded from its first snapshot on. Those of a node in the file before are missing by their numbers.
    fn skip_candidate(&mut self) {
        let Some(FirstState { header, .. }) = &self.candidate else { return };
        let is_missing = match &self.previous {
            Some(previous) => is_replay(header) && previous.run_id != header.run_id,
            None => self.seen_replay == Some(header.run_id),
        };
        if is_missing {
            self.skipped.count += 1;
            self.skipped.last_step = header.step;
        }
    }

    /// Returns the reason why the file ends before a state.
    pub(crate) fn end_at(&self, header: &SnapshotHeader) -> Option<RunEnd> {
        self.active.as_ref()?.end_at(header)
    }

    /// Returns `true` if a file has begun and not ended.
    pub(crate) fn has_started(&self) -> bool {
        self.active.is_some()
    }

    /// Accepts the last messages of a file that ends before `next`: those of earlier steps. The others
    /// stay in `messages`, for the file that begins with it.
    pub(crate) fn accept_before(
        &mut self,
        next: &State<'_>,
        messages: &mut Messages,
        batch: &mut Batch,
    ) {
        let Some(active) = &mut self.active else { return };
        active.accept_changes_before(next, batch);
        let header = next.header;
        let is_earlier = |run_id: u64, step: u64| run_id != header.run_id || step < header.step;
        self.outcomes.append(&mut messages.outcomes);
        let outcomes = self.outcomes.extract_if(.., |one| is_earlier(one.run_id, one.step));
        active.accept_outcomes(outcomes, batch);
        let statuses: Vec<_> =
            messages.statuses.extract_if(.., |one| is_earlier(one.run_id, one.step)).collect();
        active.accept_statuses(&statuses, batch);
    }

    /// Marks all accepted snapshots as written.
    pub(crate) fn mark_written(&mut self) {
        self.active.iter_mut().for_each(ActiveFile::mark_written);
    }

    /// Accepts the outcomes of steps whose states do not follow in this file, at its end.
    pub(crate) fn accept_rest(&mut self, batch: &mut Batch) {
        if let Some(active) = &mut self.active {
            active.accept_outcomes(self.outcomes.drain(..), batch);
        }
    }

    /// Ends a file. Returns its end, with the numbers of received and missing messages. The next state
    /// with its keyframe begins another one.
    pub(crate) fn end_file(&mut self, stop_reason: String) -> Closing {
        let closing = self.closing(stop_reason);
        if let Some(active) = self.active.take() {
            self.previous =
                Some(active.into_previous(self.load.as_ref().map_or(0, Load::epoch_ns)));
        }
        (self.candidate, self.unreadable) = (None, 0);
        closing
    }

    /// Starts the recording at the candidate, once it has its keyframe.
    fn start_if_ready(&mut self, now: Now, batch: &mut Batch) {
        let Some(first) = self.candidate.take_if(|first| first.has_keyframe()) else { return };
        let Some(load) = &mut self.load else { return };
        let previous = self.previous.as_ref();
        let mut active = ActiveFile::new(&first, previous, self.lost);
        active.add_gaps(self.skipped.count, 0);
        let Passed { states, outcomes } = std::mem::take(&mut self.passed);
        let ended = previous.filter(|previous| previous.run_id != first.header.run_id);
        active.add_gaps(states, outcomes + ended.map_or(0, PreviousFile::passed_outcomes));
        self.skipped_count += self.skipped.count;
        if previous.is_none() {
            active.set_steps_max(self.steps_max);
        }
        let epoch_ns = previous.and_then(|previous| previous.epoch_ns_of(&first.header));
        load.set_epoch(&first.header, epoch_ns, now);
        let header = load.run_header(&first.header, first.torn_before);
        active.count_load(&header.rows);
        active.skip_member_changes(self.status.as_ref());
        batch.header = Some(header);
        let FirstState { header, energy, particles, changes, .. } = first;
        active.accept((&header, energy), &particles, &changes, batch);
        self.active = Some(active);
    }

    /// Counts messages that could not be read since the last call. Those that a tap read with the first
    /// state, or earlier, are not missing in the recording. Returns a warning for the first error
    /// before the start, and for the first one after it.
    #[must_use]
    pub(crate) fn count_unreadable(&mut self, errors: &[ReadError]) -> Option<String> {
        let is_missing = !std::mem::take(&mut self.follows_errors);
        let has_begun =
            self.candidate.is_some() || self.active.is_some() || self.previous.is_some();
        if is_missing && has_begun {
            self.unreadable += errors.len() as u64;
        }
        let error = errors.first()?;
        let phase = self.active.is_some() && is_missing;
        let is_first = self.reported.replace(phase) != Some(phase);
        let effect = if phase { "was not recorded" } else { "before the start could not be read" };
        is_first.then(|| format!("warning: a message {effect}: {error}"))
    }

    /// Returns the snapshots since the last call that are not in a file that has begun, because they came
    /// before its first keyframe.
    pub(crate) fn take_skipped(&mut self) -> Skipped {
        std::mem::take(&mut self.skipped)
    }

    /// Returns the number of snapshots that came before the first keyframe of a file.
    pub(crate) fn skipped_count(&self) -> u64 {
        self.skipped_count
    }

    /// Begins no file until this is called with `false`. The states until then are missing.
    pub(crate) fn delay(&mut self, is_delayed: bool) {
        self.is_delayed = is_delayed;
    }

    /// Returns `true` if no file begins.
    pub(crate) fn is_delayed(&self) -> bool {
        self.is_delayed
    }

    /// Returns the numbers of missing messages since the last file, which no file declares.
    pub(crate) fn undeclared(&self) -> AllCounts {
        let mut counts = AllCounts::default();
        counts[Topic::Steps].gaps = self.passed.states;
        counts[Topic::Particles].gaps = self.passed.states;
        let passed = self.previous.as_ref().map_or(0, PreviousFile::passed_outcomes);
        counts[Topic::Outcomes].gaps = self.passed.outcomes + passed;
        counts
    }

    /// Returns the first step of the file, once it has begun.
    pub(crate) fn first_step(&self) -> Option<u64> {
        self.active.as_ref().map(|active| active.first_step)
    }

    /// Returns the last recorded state of the file, once it has begun.
    pub(crate) fn last(&self) -> Option<&SnapshotHeader> {
        self.active.as_ref().map(ActiveFile::last)
    }

    /// Returns the last step of the file so far, once it has begun.
    pub(crate) fn last_step(&self) -> Option<u64> {
        self.last().map(|last| last.step)
    }

    /// Returns the run in the file, once it has begun.
    pub(crate) fn run_id(&self) -> Option<u64> {
        self.active.as_ref().map(|active| active.run_id)
    }

    /// Sets the numbers of changes that the tap has dropped so far.
    pub(crate) fn set_lost(&mut self, lost: LostChanges) {
        self.lost = lost;
    }

    /// Returns the end of the file, with the numbers of received and missing messages.
    pub(crate) fn closing(&self, stop_reason: String) -> Closing {
        Closing { stop_reason, counts: self.counts(), unreadable: self.unreadable }
    }

    fn counts(&self) -> AllCounts {
        self.active.as_ref().map_or_else(AllCounts::default, |active| active.counts(&self.lost))
    }
}

fn is_replay(header: &SnapshotHeader) -> bool {
    header.flags & SnapshotFlags::REPLAY != 0
}

#[cfg(test)]
mod tests;
