//! What is torn at a step, followed through the messages of a recording.

use sim_contract::TearCause;

use super::keyframe_tears::KeyframeTears;
use super::message::Message;
use super::rows::TearsRow;

/// The constraints that are torn in a state.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Torn {
    /// In the order of tearing.
    pub constraints: Vec<u32>,
    /// Why each of them tore; `None` where the recording does not say.
    pub causes: Vec<Option<TearCause>>,
}

/// A change of what is torn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TearChange {
    /// From this step on nothing of what tore before is torn.
    Reset(u64),
    /// What tore.
    Tears(TearsRow),
}

/// Follows what is torn. A message counts from its step on, wherever it stands in the file: what a
/// live run is told early or late by a round of its recorder is not part of another state.
#[derive(Debug, Clone)]
pub struct TornFollower {
    torn: Torn,
    /// The step that [`Self::torn`] is of; `None` at the beginning of the file.
    step: Option<u64>,
    /// Changes of later steps.
    pending: Vec<TearChange>,
    is_known: bool,
}

impl Torn {
    /// What was torn before a recording; why stands in its first keyframe only.
    pub fn before(torn: &[u32]) -> Self {
        Self { constraints: torn.to_vec(), causes: vec![None; torn.len()] }
    }

    fn follow(&mut self, change: &TearChange) {
        match change {
            TearChange::Reset(_) => *self = Self::default(),
            TearChange::Tears(row) => {
                let cause = |place: usize| {
                    row.causes.get(place).and_then(|name| TearCause::from_name(name))
                };
                self.causes.extend((0..row.constraints.len()).map(cause));
                self.constraints.extend(&row.constraints);
            }
        }
    }
}

impl From<KeyframeTears> for Torn {
    fn from(tears: KeyframeTears) -> Self {
        let mut causes: Vec<_> = tears.causes.into_iter().map(Some).collect();
        causes.resize(tears.torn.len(), None);
        Self { constraints: tears.torn, causes }
    }
}

impl TearChange {
    /// The change that a message is, if it is one.
    pub(crate) fn from_message(message: &Message) -> Option<Self> {
        match message {
            Message::Tears(row) => Some(Self::Tears(row.clone())),
            _ => message.reset_step().map(Self::Reset),
        }
    }

    /// Of one step, a reset comes first: what tears in that step tears in the new state, and stands
    /// in the file before the outcome that says so.
    fn place(&self) -> (u64, bool) {
        match self {
            Self::Reset(step) => (*step, false),
            Self::Tears(row) => (row.step, true),
        }
    }
}

impl TornFollower {
    /// Begins at the beginning of a file, with what was torn before it.
    pub fn new(torn: Torn) -> Self {
        Self { torn, step: None, pending: Vec::new(), is_known: true }
    }

    /// Begins with a keyframe: what is of its step or before is part of it.
    pub(crate) fn from_keyframe(step: u64, tears: KeyframeTears) -> Self {
        Self { step: Some(step), ..Self::new(tears.into()) }
    }

    /// Takes a message; most say nothing of tears.
    pub fn take(&mut self, message: &Message) {
        if let Some(change) = TearChange::from_message(message) {
            self.take_change(change);
        }
        if !self.is_known
            && let Message::Keyframe { step, bytes } = message
            && let Some(tears) = KeyframeTears::read(bytes)
        {
            self.torn = tears.into();
            self.step = Some(*step);
            self.is_known = true;
            self.pending.retain(|change| change.place().0 > *step);
        }
    }

    pub(crate) fn take_change(&mut self, change: TearChange) {
        if self.step.is_none_or(|step| change.place().0 > step) {
            self.pending.push(change);
        }
    }

    /// A part of the file cannot be read: nothing is known until a keyframe says it anew.
    pub fn lose(&mut self) {
        self.is_known = false;
    }

    /// What is torn at a step, which is not before any that was asked for; `None` if that is not
    /// known.
    pub fn at(&mut self, step: u64) -> Option<&Torn> {
        let mut due: Vec<_> = self.pending.extract_if(.., |one| one.place().0 <= step).collect();
        // Stable: rows of one step stay in their order.
        due.sort_by_key(TearChange::place);
        for change in &due {
            self.torn.follow(change);
        }
        self.step = self.step.max(Some(step));
        self.is_known.then_some(&self.torn)
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{Action, Command, Outcome};

    use super::*;
    use crate::log::rows::OutcomeRow;

    fn tears(step: u64, constraints: &[u32]) -> Message {
        let causes = vec!["cut".to_owned(); constraints.len()];
        Message::Tears(TearsRow { step, constraints: constraints.to_vec(), causes })
    }

    fn reset(step: u64) -> Message {
        let command = Command::new(1, 0, Action::Reset);
        Message::Outcome(OutcomeRow::from(&Outcome::new(0, step, command, Ok(()))))
    }

    fn torn_at(follower: &mut TornFollower, step: u64) -> Vec<u32> {
        follower.at(step).unwrap().constraints.clone()
    }

    #[test]
    fn a_message_counts_from_its_step_on() {
        let mut follower = TornFollower::new(Torn::before(&[9]));
        follower.take(&tears(4, &[1, 2]));
        follower.take(&tears(6, &[3]));
        assert_eq!(torn_at(&mut follower, 3), [9]);
        assert_eq!(torn_at(&mut follower, 5), [9, 1, 2]);
        assert_eq!(torn_at(&mut follower, 6), [9, 1, 2, 3]);
        let causes = &follower.at(6).unwrap().causes;
        assert_eq!(causes[..2], [None, Some(TearCause::Cut)]);
    }

    #[test]
    fn what_tears_in_the_step_of_a_reset_is_torn_behind_it() {
        let mut follower = TornFollower::new(Torn::default());
        follower.take(&tears(2, &[5]));
        follower.take(&tears(8, &[7]));
        follower.take(&reset(8));
        assert_eq!(torn_at(&mut follower, 7), [5]);
        assert_eq!(torn_at(&mut follower, 8), [7]);
    }

    #[test]
    fn what_a_keyframe_has_is_not_taken_twice() {
        let known = KeyframeTears { torn: vec![1], causes: vec![TearCause::Force] };
        let mut follower = TornFollower::from_keyframe(4, known);
        follower.take(&tears(4, &[1]));
        follower.take(&tears(5, &[2]));
        assert_eq!(torn_at(&mut follower, 5), [1, 2]);
    }

    #[test]
    fn behind_a_gap_nothing_is_known() {
        let mut follower = TornFollower::new(Torn::default());
        follower.lose();
        follower.take(&Message::Keyframe { step: 3, bytes: vec![1, 2, 3] });
        assert_eq!(follower.at(3), None);
    }
}
