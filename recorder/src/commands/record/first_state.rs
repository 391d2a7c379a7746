//! A copy of the state at which a recording can start.

use recording::EnergyRow;
use sim_contract::{Change, KeyframeHeader, ParticleState, SnapshotHeader, State, TearsHeader};

/// A copy of a state, with the changes that a recording from this state on begins with.
#[derive(Debug)]
pub(crate) struct FirstState {
    pub(crate) header: SnapshotHeader,
    /// Its energy, if it was asked for.
    pub(crate) energy: Option<EnergyRow>,
    pub(crate) particles: Vec<ParticleState>,
    /// Constraints that tore in earlier steps.
    pub(crate) torn_before: Vec<u32>,
    /// The colliders, the tears of its own step, the parameters, and its keyframe if it has arrived.
    pub(crate) changes: Vec<Change>,
}

impl FirstState {
    /// Copies a state. Returns `None` if a part of it has not arrived, as right after attaching.
    pub(crate) fn new(state: &State<'_>) -> Option<Self> {
        let State { header, torn, colliders, parameters, .. } = *state;
        if !has_all_parts(state) {
            return None;
        }
        let own_count = own_tear_count(header, &torn.header);
        let (before, own) =
            torn.constraints.split_at(torn.constraints.len().saturating_sub(own_count));
        let mut changes = vec![
            Change::Colliders(colliders.header, colliders.colliders.clone()),
            Change::Tears(torn.header, own.to_vec()),
        ];
        // Parameters of the next step follow with its state.
        if parameters.header.step <= header.step {
            changes.push(Change::Parameters(parameters.header, parameters.values.clone()));
        }
        let mut first = Self {
            header: *header,
            energy: None,
            particles: state.particles.to_vec(),
            torn_before: before.iter().map(|torn| torn.constraint).collect(),
            changes,
        };
        for change in state.changes {
            if let Change::Keyframe(keyframe, bytes) = change {
                first.add_keyframe(keyframe, bytes);
            }
        }
        Some(first)
    }

    /// Returns `true` if a state has arrived with all its parts and its keyframe.
    pub(crate) fn is_complete(state: &State<'_>) -> bool {
        has_all_parts(state)
            && state.changes.iter().any(|change| is_keyframe_of(change, state.header))
    }

    /// Returns `true` if the keyframe has arrived.
    pub(crate) fn has_keyframe(&self) -> bool {
        self.changes.iter().any(|change| is_keyframe_of(change, &self.header))
    }

    /// Adds the keyframe of this state, and counts the outcomes since that have not changed it: they are not published
    /// again. Ignores keyframes of other states, and those that have come after outcomes that this recording lacks.
    pub(crate) fn add_keyframe(&mut self, keyframe: &KeyframeHeader, bytes: &[u8]) {
        let change = Change::Keyframe(*keyframe, bytes.to_vec());
        if !is_keyframe_of(&change, &self.header) {
            return;
        }
        self.header.outcome_count = self.header.outcome_count.max(keyframe.outcome_count);
        if !self.has_keyframe() {
            self.changes.push(change);
        }
    }
}

/// Returns `true` if everything that belongs to a state, except its keyframe, has arrived.
fn has_all_parts(state: &State<'_>) -> bool {
    let State { header, torn, colliders, parameters, .. } = *state;
    torn.constraints.len() == header.torn_count as usize
        && torn.header.run_id == header.run_id
        && colliders.header.run_id == header.run_id
        && parameters.header.run_id == header.run_id
}

/// Returns the number of constraints that tore in the step of a snapshot.
fn own_tear_count(snapshot: &SnapshotHeader, tears: &TearsHeader) -> usize {
    if tears.step == snapshot.step { tears.new_count as usize } else { 0 }
}

/// Returns `true` for a keyframe of a snapshot from which a recording has all outcomes.
fn is_keyframe_of(change: &Change, snapshot: &SnapshotHeader) -> bool {
    matches!(change, Change::Keyframe(keyframe, _)
        if (keyframe.run_id, keyframe.step) == (snapshot.run_id, snapshot.step)
            && keyframe.precedes_outcomes())
}
