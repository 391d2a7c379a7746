//! The parameters of the node, as far as they are tracker.
//!
//! A node does not publish them in plain numbers: they are those of the scene, changed by every `set`
//! that was applied. Whoever came later than one of these cannot know, and says so.

use sim_contract::{
    Action, KindFilter, NodeStatus, Outcome, Parameter, ParameterValue, ParameterValues, Setting,
    Text,
};

use crate::message::ParametersText;
use crate::sink::{Sinks, Update};
use crate::wire::convert::to_f32;

/// The parameters, as far as they are tracker.
#[derive(Debug, Default)]
pub(super) struct ParameterTracker {
    initial: Option<ParameterValues>,
    values: Option<ParameterValues>,
    /// Settings of a load that is not on show yet.
    waiting: Vec<(Text, ParameterValue, Option<KindFilter>)>,
    is_load_due: bool,
    /// The index of the next outcome.
    next_index: Option<u64>,
    is_complete: bool,
    published: Option<ParametersText>,
}

/// Most settings that wait for their load: many times what a panel has.
const WAITING_MAX: usize = 1024;

impl ParameterTracker {
    /// Another load: its parameters are those of its scene, and what was set since. The first one
    /// of a link is complete if the node had answered nothing that this link has not seen.
    pub(super) fn begin_load(&mut self, parameters: ParameterValues, outcome_count: u64) {
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
            apply_set(&mut values, parameter, value, kind);
        }
        self.initial = Some(parameters);
        self.values = Some(values);
        self.is_load_due = false;
    }

    /// Follows what the node has answered, by whomever it was asked.
    pub(super) fn apply(&mut self, outcome: &Outcome) {
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
                    apply_set(values, parameter, value, constraint_kind);
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
            values.time_scale = to_f32(status.time_scale);
        }
    }

    pub(super) fn gravity(&self) -> [f32; 3] {
        self.values.map_or([0.0; 3], |values| values.gravity)
    }

    pub(super) fn text(&self) -> ParametersText {
        ParametersText { is_complete: self.is_complete, values: self.values, initial: self.initial }
    }

    /// Publishes the parameters if they have changed.
    pub(super) fn publish(&mut self, sinks: &Sinks) {
        let text = self.text();
        if self.values.is_some() && self.published.as_ref() != Some(&text) {
            sinks.publish(&Update::Parameters(&text));
            self.published = Some(text);
        }
    }
}

/// Applies a `set` that the node has applied. A parameter of a later version has no effect.
fn apply_set(
    values: &mut ParameterValues,
    parameter: Text,
    value: ParameterValue,
    kind: Option<KindFilter>,
) {
    let constraint_kind = match kind {
        Some(KindFilter::Known(kind)) => Some(kind),
        Some(KindFilter::Unknown) | None => None,
    };
    if let Some(parameter) = Parameter::from_name(parameter.as_str()) {
        values.set(Setting { parameter, constraint_kind, value });
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

    fn begun(outcome_count: u64) -> ParameterTracker {
        let mut tracker = ParameterTracker::default();
        tracker.begin_load(ParameterValues::default(), outcome_count);
        tracker
    }

    fn damping_of(tracker: &ParameterTracker) -> f32 {
        tracker.values.unwrap().damping
    }

    #[test]
    fn who_came_after_a_command_does_not_know_until_a_reset() {
        let mut tracker = begun(3);
        assert!(!tracker.is_complete);
        tracker.apply(&outcome(3, damping(2.0)));
        assert!(!tracker.is_complete && damping_of(&tracker) == 2.0);
        tracker.apply(&outcome(4, Action::Reset));
        assert!(tracker.is_complete && damping_of(&tracker) == 0.0);
    }

    #[test]
    fn a_gap_in_the_outcomes_is_noticed() {
        let mut tracker = begun(0);
        tracker.apply(&outcome(0, Action::Pause));
        assert!(tracker.is_complete);
        tracker.apply(&outcome(2, Action::Pause));
        assert!(!tracker.is_complete);
    }

    #[test]
    fn what_is_set_after_a_load_waits_for_it() {
        let mut tracker = begun(0);
        tracker.apply(&outcome(0, damping(1.0)));
        tracker.apply(&outcome(1, Action::Load { scene: Text::cut("rope") }));
        tracker.apply(&outcome(2, damping(2.0)));
        assert_eq!(damping_of(&tracker), 1.0);
        tracker.begin_load(ParameterValues::default(), 3);
        assert!(tracker.is_complete && damping_of(&tracker) == 2.0);
    }

    #[test]
    fn a_rejected_command_changes_nothing() {
        let mut tracker = begun(0);
        let command = Command::new(1, 0, damping(1.0));
        tracker.apply(&Outcome::new(0, 10, command, Err(Reason::OutOfRange)));
        assert_eq!(damping_of(&tracker), 0.0);
    }
}
