//! The parameters of the node, as far as they are known.
//!
//! A node does not publish them in plain numbers: they are those of the scene, changed by every `set`
//! that was applied. Whoever came later than one of these cannot know, and says so.

use sim_contract::{Action, KindFilter, NodeStatus, Outcome, ParameterValue, PlainF32, Text};

use crate::message::parameters::Parameters;
use crate::message::{ParametersText, ToPage};
use crate::pages::hub::Hub;
use crate::pages::hub::Slot;
use crate::shown_state::single;

/// The parameters, as far as they are known.
#[derive(Debug, Default)]
pub(super) struct Known {
    initial: Option<Parameters>,
    values: Option<Parameters>,
    /// Settings of a load that is not on show yet.
    waiting: Vec<(Text, ParameterValue, Option<KindFilter>)>,
    is_load_due: bool,
    /// The index of the next outcome.
    next_index: Option<u64>,
    is_complete: bool,
    told: Option<ToPage>,
}

/// Most settings that wait for their load: many times what a panel has.
const WAITING_MAX: usize = 1024;

impl Known {
    /// Another load: its parameters are those of its scene, and what was set since. The first one
    /// of a link is complete if the node had answered nothing that this link has not seen.
    pub(super) fn begin(&mut self, parameters: Parameters, outcome_count: u64) {
        match (self.initial, self.next_index) {
            (None, None) => {
                self.is_complete = outcome_count == 0;
                self.next_index = Some(outcome_count);
            }
            (None, Some(_)) => {}
            (Some(_), _) => self.is_complete = true,
        }
        let mut values = parameters;
        for (parameter, value, kind) in self.waiting.drain(..) {
            values.follow(parameter.as_str(), value, kind);
        }
        self.initial = Some(parameters);
        self.values = Some(values);
        self.is_load_due = false;
    }

    /// Follows what the node has answered, by whomever it was asked.
    pub(super) fn follow(&mut self, outcome: &Outcome) {
        match self.next_index {
            None => self.is_complete = outcome.index == 0,
            Some(expected) if expected != outcome.index => self.is_complete = false,
            Some(_) => {}
        }
        self.next_index = Some(outcome.index + 1);
        if !outcome.is_applied() {
            return;
        }
        match outcome.command.action() {
            Action::Set { parameter, value, constraint_kind } => match &mut self.values {
                Some(values) if !self.is_load_due => {
                    values.follow(parameter.as_str(), value, constraint_kind);
                }
                _ if self.waiting.len() < WAITING_MAX => {
                    self.waiting.push((parameter, value, constraint_kind));
                }
                _ => self.is_complete = false,
            },
            Action::Reset => {
                self.values = self.initial;
                self.waiting.clear();
                self.is_complete = true;
            }
            Action::Load { .. } => {
                self.waiting.clear();
                self.is_load_due = true;
            }
            _ => {}
        }
    }

    /// The pace is the node's: a reset does not change it, and the status has it.
    pub(super) fn set_time_scale(&mut self, status: Option<&NodeStatus>) {
        if let (Some(values), Some(status)) = (&mut self.values, status) {
            values.time_scale = PlainF32(single(status.time_scale));
        }
    }

    pub(super) fn gravity(&self) -> [f32; 3] {
        self.values.map_or([0.0; 3], |values| values.gravity.map(|axis| axis.0))
    }

    pub(super) fn to_message(&self) -> ToPage {
        ToPage::Parameters(Box::new(ParametersText {
            is_complete: self.is_complete,
            values: self.values,
            initial: self.initial,
        }))
    }

    /// Tells pages what has changed.
    pub(super) fn tell(&mut self, hub: &Hub) {
        let message = self.to_message();
        if self.values.is_some() && self.told.as_ref() != Some(&message) {
            hub.latch(Slot::Parameters, &message);
            self.told = Some(message);
        }
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{Command, Reason};

    use super::*;

    fn outcome(index: u64, action: Action) -> Outcome {
        Outcome::new(index, 10, Command::new(1, index, action), Ok(()))
    }

    fn damping(value: f32) -> Action {
        let parameter = Text::cut("damping");
        Action::Set { parameter, value: ParameterValue::Number(value), constraint_kind: None }
    }

    fn begun(outcome_count: u64) -> Known {
        let mut known = Known::default();
        known.begin(Parameters::default(), outcome_count);
        known
    }

    fn damping_of(known: &Known) -> f32 {
        known.values.unwrap().damping.0
    }

    #[test]
    fn who_came_after_a_command_does_not_know_until_a_reset() {
        let mut known = begun(3);
        assert!(!known.is_complete);
        known.follow(&outcome(3, damping(2.0)));
        assert!(!known.is_complete && damping_of(&known) == 2.0);
        known.follow(&outcome(4, Action::Reset));
        assert!(known.is_complete && damping_of(&known) == 0.0);
    }

    #[test]
    fn a_gap_in_the_outcomes_is_noticed() {
        let mut known = begun(0);
        known.follow(&outcome(0, Action::Pause));
        assert!(known.is_complete);
        known.follow(&outcome(2, Action::Pause));
        assert!(!known.is_complete);
    }

    #[test]
    fn what_is_set_after_a_load_waits_for_it() {
        let mut known = begun(0);
        known.follow(&outcome(0, damping(1.0)));
        known.follow(&outcome(1, Action::Load { scene: Text::cut("rope") }));
        known.follow(&outcome(2, damping(2.0)));
        assert_eq!(damping_of(&known), 1.0);
        known.begin(Parameters::default(), 3);
        assert!(known.is_complete && damping_of(&known) == 2.0);
    }

    #[test]
    fn a_rejected_command_changes_nothing() {
        let mut known = begun(0);
        let command = Command::new(1, 0, damping(1.0));
        known.follow(&Outcome::new(0, 10, command, Err(Reason::OutOfRange)));
        assert_eq!(damping_of(&known), 0.0);
    }
}
