//! The state of a recorded run, which the messages of a recording build up.

use std::sync::Arc;

use sim_messages::{Action, ColliderState, ParameterValues, ParticleState, Torn};
use sim_solver::Keyframe;

use super::message::Message;
use super::read::frames::Frame;
use super::rows::{
    ColliderRow, CollidersRow, ForcesRow, OutcomeRow, ParametersRow, StatusRow, StepRow,
    TopologyRow,
};
use super::tears::torn_in_keyframe;

/// The state of a recorded run: a snapshot, and the newest message of each topic up to it.
#[derive(Debug, Clone, Default)]
pub struct RecordedState {
    /// The header of the snapshot. If it is unreadable, every field except the step is 0.
    pub row: StepRow,
    /// The header was readable.
    pub has_readable_row: bool,
    /// Shape: particle count.
    pub particles: Arc<Vec<ParticleState>>,
    /// The torn constraints.
    pub torn: Torn,
    /// The poses of the colliders, if there are any.
    pub colliders: Option<CollidersRow>,
    /// The parameters, if the file has readable ones.
    pub parameters: Option<ParametersRow>,
    /// The forces of the step, if they were read.
    pub forces: Option<ForcesRow>,
    /// The latest status of the node, if there is one.
    pub status: Option<StatusRow>,
    /// The newest keyframe and its step, if they were read.
    pub keyframe: Option<(u64, Vec<u8>)>,
    /// The node was paused, as far as keyframes and outcomes tell.
    pub is_paused: bool,
    /// Number of rejected commands.
    pub rejected_count: u64,
}

impl RecordedState {
    /// Starts before the first snapshot of a file, with the constraints that were torn before it and the
    /// parameters of the first snapshot, which equal the parameters at the load.
    pub fn before_first(topology: &TopologyRow, first: &Frame) -> Self {
        let mut parameters = first.updates.iter().rev();
        let parameters = parameters.find_map(|update| match update {
            Message::Parameters(row) => Some(row.clone()),
            _ => None,
        });
        Self { torn: torn_before_first(topology, first), parameters, ..Self::default() }
    }

    /// Applies the next message of the file, except the load.
    pub fn apply(&mut self, message: &Message) {
        match message {
            Message::Tears(row) => self.torn.extend(row.step, row.torn()),
            Message::Colliders(row) => self.colliders = Some(row.clone()),
            Message::Parameters(row) => self.parameters = Some(row.clone()),
            Message::Forces(row) => self.forces = Some(row.clone()),
            Message::Status(row) => self.status = Some(row.clone()),
            Message::Keyframe { step, bytes } => self.set_keyframe(*step, bytes.clone()),
            Message::Outcome(row) => self.apply_outcome(row),
            Message::Step(row) => (self.row, self.has_readable_row) = (*row, true),
            _ => {}
        }
    }

    /// Replaces the keyframe.
    pub fn set_keyframe(&mut self, step: u64, bytes: Vec<u8>) {
        // A keyframe of another version cannot be decoded here.
        if let Ok(keyframe) = Keyframe::decode(&bytes) {
            self.is_paused = keyframe.paused;
        }
        self.keyframe = Some((step, bytes));
    }

    fn apply_outcome(&mut self, row: &OutcomeRow) {
        self.row.outcome_count = row.index.saturating_add(1);
        if !row.is_applied() {
            self.rejected_count += 1;
            return;
        }
        if row.replaces_state() {
            self.torn.reset(row.step);
        }
        match row.action {
            Action::Pause => self.is_paused = true,
            Action::Resume => self.is_paused = false,
            _ => {}
        }
    }

    /// Returns the step of the newest keyframe; 0 without one.
    pub fn keyframe_step(&self) -> u64 {
        self.keyframe.as_ref().map_or(0, |(step, _)| *step)
    }

    /// Returns the colliders.
    pub fn colliders(&self) -> &[ColliderRow] {
        self.colliders.as_ref().map_or(&[], |row| &row.colliders)
    }

    /// Returns the colliders as a node publishes them.
    pub fn collider_states(&self) -> Vec<ColliderState> {
        self.colliders.as_ref().map(CollidersRow::states).unwrap_or_default()
    }

    /// Returns the values of the parameters; the default values where the file has none.
    pub fn parameter_values(&self) -> ParameterValues {
        self.parameters.as_ref().map(|row| row.values.clone()).unwrap_or_default()
    }

    /// Returns the difference of step and scene step, modulo 2^64, if the header was readable: it changes
    /// at each load, and with each state that a command puts in place.
    pub fn beginning(&self) -> Option<u64> {
        self.has_readable_row.then(|| self.row.step.wrapping_sub(self.row.scene_step))
    }
}

/// Returns the constraints that were torn before a recording, with the causes in the keyframe of its
/// first snapshot.
fn torn_before_first(topology: &TopologyRow, first: &Frame) -> Torn {
    let mut torn = topology.torn_before();
    let count = torn.constraints.len();
    if let Some(complete) = first.own_keyframe().and_then(torn_in_keyframe)
        && complete.indices().take(count).eq(torn.indices())
    {
        torn.constraints.copy_from_slice(&complete.constraints[..count]);
    }
    torn.header.since_step = first.row.step.saturating_sub(first.row.scene_step);
    torn
}

#[cfg(test)]
mod tests {
    use sim_messages::{Command, LoadHeader, Outcome, TearCause, TearsHeader, TornConstraint};
    use sim_solver::{Scene, Solver, builtin};

    use super::*;
    use crate::log::rows::TearsRow;

    fn tears(step: u64, constraints: &[u32]) -> Message {
        let causes = vec!["cut".to_owned(); constraints.len()];
        Message::Tears(TearsRow { step, constraints: constraints.to_vec(), causes })
    }

    fn torn(state: &RecordedState) -> Vec<u32> {
        state.torn.indices().collect()
    }

    #[test]
    fn tears_are_added_to_those_before_the_file() {
        let torn_before = [TornConstraint::new(9, None)].into_iter().collect();
        let mut state = RecordedState { torn: torn_before, ..RecordedState::default() };
        state.apply(&tears(4, &[1, 2]));
        assert_eq!(torn(&state), [9, 1, 2]);
        state.apply(&tears(6, &[3]));
        let causes: Vec<_> = state.torn.constraints.iter().map(TornConstraint::cause).collect();
        assert_eq!(causes[..2], [None, Some(TearCause::Cut)]);
        let expected = TearsHeader { run_id: 0, step: 6, since_step: 0, new_count: 1, count: 4 };
        assert_eq!(state.torn.header, expected);
    }

    #[test]
    fn tears_in_the_step_of_a_reset_follow_the_reset() {
        let mut state = RecordedState::default();
        state.apply(&tears(2, &[5]));
        assert_eq!(torn(&state), [5]);
        let reset = Outcome::new(0, 8, Command::new(1, 0, Action::Reset), Ok(()));
        state.apply(&Message::Outcome(OutcomeRow::from(&reset)));
        state.apply(&tears(8, &[7]));
        assert_eq!((torn(&state), state.torn.header.since_step), (vec![7], 8));
    }

    #[test]
    fn the_first_keyframe_has_the_causes_of_earlier_tears() {
        let scene = Scene::from_toml(builtin::text("rope").unwrap(), "rope").unwrap();
        let mut solver = Solver::new(&scene);
        solver.cut(3).unwrap();
        solver.step();
        let causes = |torn: &[u32], bytes: Vec<u8>| {
            let topology = TopologyRow {
                torn: torn.to_vec(),
                ..TopologyRow::new(&LoadHeader::default(), &[], &[])
            };
            let first = Frame {
                updates: vec![Message::Keyframe { step: 1, bytes }],
                row: StepRow { step: 1, ..StepRow::default() },
                particles: None,
                log_times_ns: Vec::new(),
            };
            let torn = RecordedState::before_first(&topology, &first).torn;
            torn.constraints.iter().map(TornConstraint::cause).collect::<Vec<_>>()
        };
        let keyframe = solver.keyframe().encode();
        assert_eq!(causes(&[3], keyframe.clone()), [Some(TearCause::Cut)]);
        assert_eq!(causes(&[], keyframe.clone()), []);
        assert_eq!(causes(&[4], keyframe), [None], "a keyframe of another state");
        assert_eq!(causes(&[3], vec![0; 9]), [None], "a damaged keyframe");
    }
}
