//! Selects the states and messages of a recording: its start, its end, and the missing messages.

mod started;

use recorder::{AllCounts, Closing};
use sim_contract::{Change, LostChanges, NodeStatus, Outcome, ReadError, State};

use super::accepted::Accepted;
use super::first_state::FirstState;
use super::load::{Load, LoadError, Now};
use super::messages::Messages;
use started::Started;

/// Most outcomes to keep before the first state. Beyond it the oldest are dropped.
const OUTCOMES_PENDING_MAX: usize = 1 << 16;

/// Accepts a run from the first state that has its keyframe.
#[derive(Debug, Default)]
pub(crate) struct Intake {
    /// Steps to record after the first one.
    steps_max: Option<u64>,
    /// The load of the newest state, until the recording starts.
    load: Option<Load>,
    /// The newest state, until its keyframe arrives. A paused node publishes it after the state.
    candidate: Option<FirstState>,
    /// The newest status, until the recording starts.
    status: Option<NodeStatus>,
    /// Outcomes that may follow the first state.
    outcomes: Vec<Outcome>,
    started: Option<Started>,
    lost: LostChanges,
    /// Messages after the first state or the candidate that arrived but could not be read.
    unreadable: u64,
    /// The candidate or first state is new, and the errors of the messages before it have not been added.
    follows_errors: bool,
    /// An error was reported, and the recording had started then.
    reported: Option<bool>,
}

impl Intake {
    /// Accepts up to `steps_max` steps after the first one.
    pub(crate) fn new(steps_max: Option<u64>) -> Self {
        Self { steps_max, ..Self::default() }
    }

    /// Accepts the next state of a tap.
    pub(crate) fn accept_state(
        &mut self,
        state: &State<'_>,
        now: Now,
        accepted: &mut Accepted,
    ) -> Result<(), LoadError> {
        for change in state.changes {
            if let Change::Keyframe(header, bytes) = change
                && let Some(candidate) = &mut self.candidate
            {
                candidate.add_keyframe(header, bytes);
            }
        }
        self.start_if_ready(now, accepted);
        if let Some(started) = &mut self.started {
            let particles = state.particles.to_vec();
            started.accept(state.header, particles, state.changes, accepted);
            return Ok(());
        }
        if matches!(state.changes.first(), Some(Change::Load)) {
            self.load = Some(Load::new(state.load)?);
        }
        self.outcomes.retain(|outcome| {
            outcome.run_id != state.header.run_id || outcome.index >= state.header.outcome_count
        });
        self.candidate = FirstState::new(state);
        (self.unreadable, self.follows_errors) = (0, true);
        self.start_if_ready(now, accepted);
        Ok(())
    }

    /// Accepts the messages that have arrived between states.
    pub(crate) fn accept_messages(
        &mut self,
        messages: Messages,
        now: Now,
        accepted: &mut Accepted,
    ) {
        if let Some(candidate) = &mut self.candidate {
            for (header, bytes) in &messages.keyframes {
                candidate.add_keyframe(header, bytes);
            }
            self.start_if_ready(now, accepted);
        }
        self.outcomes.extend(messages.outcomes);
        let Some(started) = &mut self.started else {
            let excess = self.outcomes.len().saturating_sub(OUTCOMES_PENDING_MAX);
            self.outcomes.drain(..excess);
            self.status = messages.statuses.last().copied().or(self.status);
            return;
        };
        started.accept_outcomes(self.outcomes.drain(..), accepted);
        started.accept_statuses(&messages.statuses, accepted);
    }

    /// Starts the recording at the candidate, once it has its keyframe.
    fn start_if_ready(&mut self, now: Now, accepted: &mut Accepted) {
        let Some(first) = self.candidate.take_if(|first| first.has_keyframe()) else { return };
        let Some(load) = self.load.take() else { return };
        let mut started = Started::new(&first, self.steps_max, self.lost);
        let header = load.into_run_header(&first.header, first.torn_before, now);
        started.count_load(&header.rows);
        started.skip_member_changes(self.status.as_ref());
        accepted.header = Some(header);
        let FirstState { header, particles, changes, .. } = first;
        started.accept(&header, particles, &changes, accepted);
        self.started = Some(started);
    }

    /// Counts messages that could not be read since the last call. Those that a tap read with the first
    /// state, or earlier, are not missing in the recording. Returns a warning for the first error
    /// before the start, and for the first one after it.
    #[must_use]
    pub(crate) fn count_unreadable(&mut self, errors: &[ReadError]) -> Option<String> {
        let is_missing = !std::mem::take(&mut self.follows_errors);
        if is_missing && (self.candidate.is_some() || self.started.is_some()) {
            self.unreadable += errors.len() as u64;
        }
        let error = errors.first()?;
        let phase = self.started.is_some() && is_missing;
        let is_first = self.reported.replace(phase) != Some(phase);
        let effect = if phase { "was not recorded" } else { "before the start could not be read" };
        is_first.then(|| format!("warning: a message {effect}: {error}"))
    }

    /// Returns the first recorded step, once the recording has started.
    pub(crate) fn first_step(&self) -> Option<u64> {
        self.started.as_ref().map(|started| started.first_step)
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
        self.started.as_ref().map_or_else(AllCounts::default, |started| started.counts(&self.lost))
    }
}

#[cfg(test)]
mod tests;
