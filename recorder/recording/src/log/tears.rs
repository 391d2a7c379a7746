//! The torn constraints, tracked through the messages of a recording.

use sim_contract::{Torn, TornConstraint};
use sim_solver::Keyframe;

use super::message::Message;
use super::read::frames::Frame;
use super::rows::{TearsRow, TopologyRow};

/// A change of the torn constraints.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TearChange {
    /// From this step on, the earlier tears are undone. Those of a state that was put in place follow as
    /// tears of the same step.
    Reset(u64),
    /// New tears.
    Tears(TearsRow),
}

/// The torn constraints after the messages so far.
#[derive(Debug, Clone)]
pub struct TearTracker {
    torn: Torn,
    is_known: bool,
}

/// Returns the constraints that were torn before a recording, with the causes in the keyframe of its
/// first snapshot.
pub fn torn_before_first(topology: &TopologyRow, first: &Frame) -> Torn {
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

/// Returns the torn constraints in a keyframe, or `None` if it is damaged or has another version.
pub(crate) fn torn_in_keyframe(bytes: &[u8]) -> Option<Torn> {
    let keyframe = Keyframe::decode(bytes).ok()?;
    let pairs = keyframe.torn().iter().zip(keyframe.tear_causes());
    Some(pairs.map(|(index, cause)| TornConstraint::new(*index, Some(*cause))).collect())
}

impl TearChange {
    /// Returns the change that a message describes, if any.
    pub(crate) fn from_message(message: &Message) -> Option<Self> {
        match message {
            Message::Tears(row) => Some(Self::Tears(row.clone())),
            _ => message.replacement_step().map(Self::Reset),
        }
    }

    /// Returns the first step with the change.
    pub(crate) fn step(&self) -> u64 {
        match self {
            Self::Reset(step) => *step,
            Self::Tears(row) => row.step,
        }
    }
}

impl TearTracker {
    /// Starts with the torn constraints of a state, or with those before a file.
    pub fn new(torn: Torn) -> Self {
        Self { torn, is_known: true }
    }

    /// Processes the next message of the file. Most messages do not concern tears.
    pub fn process(&mut self, message: &Message) {
        if let Some(change) = TearChange::from_message(message) {
            self.add(&change);
        }
        if !self.is_known
            && let Message::Keyframe { bytes, .. } = message
            && let Some(torn) = torn_in_keyframe(bytes)
        {
            (self.torn, self.is_known) = (torn, true);
        }
    }

    pub(crate) fn add(&mut self, change: &TearChange) {
        match change {
            TearChange::Reset(step) => self.torn.reset(*step),
            TearChange::Tears(row) => self.torn.extend(row.step, row.torn()),
        }
    }

    /// Marks a part of the file as unreadable. The torn constraints are unknown until the next
    /// keyframe.
    pub fn mark_gap(&mut self) {
        self.is_known = false;
    }

    /// Returns the torn constraints, or `None` if they are unknown.
    pub fn torn(&self) -> Option<&Torn> {
        self.is_known.then_some(&self.torn)
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{Action, Command, Outcome, TearCause, TearsHeader};
    use sim_solver::{Scene, Solver, builtin};

    use super::*;
    use crate::log::rows::{OutcomeRow, StepRow};

    fn tears(step: u64, constraints: &[u32]) -> Message {
        let causes = vec!["cut".to_owned(); constraints.len()];
        Message::Tears(TearsRow { step, constraints: constraints.to_vec(), causes })
    }

    fn reset(step: u64) -> Message {
        let command = Command::new(1, 0, Action::Reset);
        Message::Outcome(OutcomeRow::from(&Outcome::new(0, step, command, Ok(()))))
    }

    fn before(torn: &[u32]) -> Torn {
        torn.iter().map(|index| TornConstraint::new(*index, None)).collect()
    }

    fn torn(tracker: &TearTracker) -> Vec<u32> {
        tracker.torn().unwrap().indices().collect()
    }

    #[test]
    fn tears_are_added_to_those_before_the_file() {
        let mut tracker = TearTracker::new(before(&[9]));
        tracker.process(&tears(4, &[1, 2]));
        assert_eq!(torn(&tracker), [9, 1, 2]);
        tracker.process(&tears(6, &[3]));
        let torn = tracker.torn().unwrap();
        let causes: Vec<_> = torn.constraints.iter().map(TornConstraint::cause).collect();
        assert_eq!(causes[..2], [None, Some(TearCause::Cut)]);
        let expected = TearsHeader { run_id: 0, step: 6, since_step: 0, new_count: 1, count: 4 };
        assert_eq!(torn.header, expected);
    }

    #[test]
    fn tears_in_the_step_of_a_reset_follow_the_reset() {
        let mut tracker = TearTracker::new(Torn::default());
        tracker.process(&tears(2, &[5]));
        assert_eq!(torn(&tracker), [5]);
        tracker.process(&reset(8));
        tracker.process(&tears(8, &[7]));
        assert_eq!(torn(&tracker), [7]);
        assert_eq!(tracker.torn().unwrap().header.since_step, 8);
    }

    #[test]
    fn after_a_gap_the_torn_constraints_are_unknown() {
        let mut tracker = TearTracker::new(Torn::default());
        tracker.mark_gap();
        tracker.process(&Message::Keyframe { step: 3, bytes: vec![1, 2, 3] });
        assert_eq!(tracker.torn(), None);
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
                ..TopologyRow::new(&sim_contract::LoadHeader::default(), &[], &[])
            };
            let first = Frame {
                updates: vec![Message::Keyframe { step: 1, bytes }],
                row: StepRow { step: 1, ..StepRow::default() },
                particles: None,
                log_times_ns: Vec::new(),
            };
            let torn = torn_before_first(&topology, &first);
            torn.constraints.iter().map(TornConstraint::cause).collect::<Vec<_>>()
        };
        let keyframe = solver.keyframe().encode();
        assert_eq!(causes(&[3], keyframe.clone()), [Some(TearCause::Cut)]);
        assert_eq!(causes(&[], keyframe.clone()), []);
        assert_eq!(causes(&[4], keyframe), [None], "a keyframe of another state");
        assert_eq!(causes(&[3], vec![0; 9]), [None], "a damaged keyframe");
    }
}
