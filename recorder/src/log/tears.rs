//! The torn constraints at each step, tracked through the messages of a recording.

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

/// Tracks the torn constraints. A message takes effect at its step, independent of its position in
/// the file, because a batch of the recorder may contain later messages early.
#[derive(Debug, Clone)]
pub struct TearTracker {
    torn: Torn,
    /// The step of [`Self::torn`]. `None` at the start of the file.
    step: Option<u64>,
    /// Changes in later steps.
    pending: Vec<TearChange>,
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

    /// Returns the sort key. In each step a reset comes first, because the tears of that step belong
    /// to the new state. In the file they precede the outcome of the reset.
    fn order(&self) -> (u64, bool) {
        match self {
            Self::Reset(step) => (*step, false),
            Self::Tears(row) => (row.step, true),
        }
    }
}

impl TearTracker {
    /// Starts at the start of a file, with the constraints that were torn before.
    pub fn new(torn: Torn) -> Self {
        Self { torn, step: None, pending: Vec::new(), is_known: true }
    }

    /// Starts at a step with all torn constraints of that step, such as those of a keyframe.
    pub fn from_step(step: u64, torn: Torn) -> Self {
        Self { step: Some(step), ..Self::new(torn) }
    }

    /// Processes a message. Most messages do not concern tears.
    pub fn process(&mut self, message: &Message) {
        if let Some(change) = TearChange::from_message(message) {
            self.add(change);
        }
        if !self.is_known
            && let Message::Keyframe { step, bytes } = message
            && let Some(torn) = torn_in_keyframe(bytes)
        {
            self.torn = torn;
            self.step = Some(*step);
            self.is_known = true;
            self.pending.retain(|change| change.order().0 > *step);
        }
    }

    pub(crate) fn add(&mut self, change: TearChange) {
        if self.step.is_none_or(|step| change.order().0 > step) {
            self.pending.push(change);
        }
    }

    /// Marks a part of the file as unreadable. The torn constraints are unknown until the next
    /// keyframe.
    pub fn mark_gap(&mut self) {
        self.is_known = false;
    }

    /// Returns the torn constraints at a step, or `None` if they are unknown. Steps never decrease
    /// from call to call.
    pub fn at(&mut self, step: u64) -> Option<&Torn> {
        let mut due: Vec<_> = self.pending.extract_if(.., |one| one.order().0 <= step).collect();
        // The sort is stable, so rows of one step keep their order.
        due.sort_by_key(TearChange::order);
        for change in &due {
            match change {
                TearChange::Reset(step) => self.torn.reset(*step),
                TearChange::Tears(row) => self.torn.extend(row.step, row.torn()),
            }
        }
        self.step = self.step.max(Some(step));
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

    fn torn_at(tracker: &mut TearTracker, step: u64) -> Vec<u32> {
        tracker.at(step).unwrap().indices().collect()
    }

    #[test]
    fn a_message_takes_effect_at_its_step() {
        let mut tracker = TearTracker::new(before(&[9]));
        tracker.process(&tears(4, &[1, 2]));
        tracker.process(&tears(6, &[3]));
        assert_eq!(torn_at(&mut tracker, 3), [9]);
        assert_eq!(torn_at(&mut tracker, 5), [9, 1, 2]);
        let torn = tracker.at(6).unwrap();
        let causes: Vec<_> = torn.constraints.iter().map(TornConstraint::cause).collect();
        assert_eq!(causes[..2], [None, Some(TearCause::Cut)]);
        let expected = TearsHeader { run_id: 0, step: 6, since_step: 0, new_count: 1, count: 4 };
        assert_eq!(torn.header, expected);
    }

    #[test]
    fn tears_in_the_step_of_a_reset_follow_the_reset() {
        let mut tracker = TearTracker::new(Torn::default());
        tracker.process(&tears(2, &[5]));
        tracker.process(&tears(8, &[7]));
        tracker.process(&reset(8));
        assert_eq!(torn_at(&mut tracker, 7), [5]);
        assert_eq!(torn_at(&mut tracker, 8), [7]);
        assert_eq!(tracker.at(8).unwrap().header.since_step, 8);
    }

    #[test]
    fn tears_that_a_keyframe_includes_are_not_added_twice() {
        let mut tracker = TearTracker::from_step(4, before(&[1]));
        tracker.process(&tears(4, &[1]));
        tracker.process(&tears(5, &[2]));
        assert_eq!(torn_at(&mut tracker, 5), [1, 2]);
    }

    #[test]
    fn after_a_gap_the_torn_constraints_are_unknown() {
        let mut tracker = TearTracker::new(Torn::default());
        tracker.mark_gap();
        tracker.process(&Message::Keyframe { step: 3, bytes: vec![1, 2, 3] });
        assert_eq!(tracker.at(3), None);
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
