//! The state of a replay: the values for headers and for late subscribers.

use std::collections::BTreeSet;

use recording::{CollidersRow, Message, OutcomeRow, StatusRow, TapeState, TearTracker};
use sim_contract::{Action, ParameterValues, Torn};
use sim_solver::Keyframe;

/// The state of a replay after the messages so far, as far as `/steps` does not contain it.
#[derive(Debug, Clone)]
pub(crate) struct Position {
    pub(super) keyframe_step: u64,
    /// The newest keyframe before the first published snapshot.
    pub(super) latched_keyframe: Option<Vec<u8>>,
    /// The newest colliders before the first published snapshot.
    pub(super) latched_colliders: Option<CollidersRow>,
    /// The newest colliders.
    colliders: Option<CollidersRow>,
    /// The newest status of the node before the first published snapshot.
    pub(super) latched_status: Option<StatusRow>,
    /// The recorded node was paused.
    pub(super) is_paused: bool,
    /// Number of outcomes so far.
    pub(super) outcome_count: u64,
    pub(super) rejected_count: u64,
    pub(super) tears: TearTracker,
    pub(super) parameters: ParameterValues,
}

impl Position {
    /// Starts with the constraints that were torn before the recording.
    pub(crate) fn new(torn: Torn) -> Self {
        Self {
            keyframe_step: 0,
            latched_keyframe: None,
            latched_colliders: None,
            colliders: None,
            latched_status: None,
            is_paused: false,
            outcome_count: 0,
            rejected_count: 0,
            tears: TearTracker::new(torn),
            parameters: ParameterValues::default(),
        }
    }

    /// Starts at a state in the middle of a recording, with the newest keyframe up to its step.
    pub(crate) fn at(state: &TapeState, keyframe: Option<(u64, Vec<u8>)>) -> Self {
        let mut torn = state.torn.clone();
        torn.header.since_step = state.row.step.saturating_sub(state.row.scene_step);
        let mut position = Self::new(torn);
        position.outcome_count = state.row.outcome_count;
        position.rejected_count = state.status.as_ref().map_or(0, |row| row.rejected_count);
        position.latched_colliders.clone_from(&state.colliders);
        position.colliders.clone_from(&state.colliders);
        position.latched_status.clone_from(&state.status);
        if let Some(row) = &state.parameters {
            position.parameters.clone_from(&row.values);
        }
        if let Some((step, bytes)) = keyframe {
            position.apply(&Message::Keyframe { step, bytes: bytes.clone() });
            position.latched_keyframe = Some(bytes);
        }
        position
    }

    /// Applies a message.
    pub(crate) fn apply(&mut self, message: &Message) {
        self.tears.process(message);
        self.apply_parameters(message);
        match message {
            Message::Keyframe { step, bytes } => {
                self.keyframe_step = *step;
                // A keyframe of another version is published, but it cannot be decoded here.
                if let Ok(keyframe) = Keyframe::decode(bytes) {
                    self.is_paused = keyframe.paused;
                }
            }
            Message::Colliders(row) => self.colliders = Some(row.clone()),
            Message::Outcome(row) => self.apply_outcome(row),
            _ => {}
        }
    }

    /// Applies a message to the parameters only. The load of a replay has those of its first snapshot.
    pub(crate) fn apply_parameters(&mut self, message: &Message) {
        if let Message::Parameters(row) = message {
            self.parameters.clone_from(&row.values);
        }
    }

    /// Returns `true` if the torn constraints, colliders and parameters are the same in both, as
    /// far as they are known.
    pub(super) fn agrees_with(&self, other: &Self) -> bool {
        let are_same_colliders = match (&self.colliders, &other.colliders) {
            (Some(one), Some(two)) => one.states() == two.states(),
            _ => true,
        };
        are_same_colliders
            && self.parameters == other.parameters
            && self.torn_indices() == other.torn_indices()
    }

    fn torn_indices(&self) -> Option<BTreeSet<u32>> {
        self.tears.torn().map(|torn| torn.indices().collect())
    }

    fn apply_outcome(&mut self, row: &OutcomeRow) {
        let is_applied = row.is_applied();
        self.outcome_count = row.index.saturating_add(1);
        self.rejected_count += u64::from(!is_applied);
        match row.action {
            Action::Pause if is_applied => self.is_paused = true,
            Action::Resume if is_applied => self.is_paused = false,
            _ => {}
        }
    }
}
