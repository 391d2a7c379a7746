//! The parameters at each step of a recording: those of its scene, and what was set until then.

use recorder::OutcomeRow;
use sim_contract::{Action, KindFilter, Parameter, ParameterValue, ParameterValues, Setting, Text};

/// Most settings of a recording: hours of moving a slider. What is beyond is not known.
const CHANGES_MAX: usize = 1 << 18;

/// What has changed the parameters of a recording, in order.
#[derive(Debug, Clone)]
pub(super) struct ParameterLog {
    changes: Vec<(u64, Change)>,
    next_index: u64,
}

#[derive(Debug, Clone, Copy)]
enum Change {
    Set(Text, ParameterValue, Option<KindFilter>),
    /// Everything is as the scene has it.
    Reset,
    /// There may have been settings that the recording has lost.
    Gap,
}

impl ParameterLog {
    /// Of a recording whose first state has had that many outcomes.
    pub(super) fn new(first_step: u64, outcome_count: u64) -> Self {
        let changes = if outcome_count == 0 { Vec::new() } else { vec![(first_step, Change::Gap)] };
        Self { changes, next_index: outcome_count }
    }

    /// Takes the next outcome of the recording.
    pub(super) fn add_outcome(&mut self, row: &OutcomeRow) {
        if row.index > self.next_index {
            self.add_gap(row.step);
        }
        self.next_index = row.index + 1;
        let change = match row.action {
            Action::Set { parameter, value, constraint_kind } => {
                Change::Set(parameter, value, constraint_kind)
            }
            Action::Reset => Change::Reset,
            _ => return,
        };
        if row.is_applied() {
            self.add(row.step, change);
        }
    }

    /// A part of the recording cannot be read, from about this step on.
    pub(super) fn add_gap(&mut self, step: u64) {
        self.add(step, Change::Gap);
    }

    fn add(&mut self, step: u64, change: Change) {
        if self.changes.len() < CHANGES_MAX {
            self.changes.push((step, change));
        } else if let Some((_, last)) = self.changes.last_mut() {
            *last = Change::Gap;
        }
    }

    /// How many changes there are up to a step: as long as it stays, the parameters do.
    pub(super) fn count_until(&self, step: u64) -> usize {
        self.changes.iter().take_while(|(of, _)| *of <= step).count()
    }

    /// The parameters after that many changes, and whether nothing can be missing.
    pub(super) fn after(&self, count: usize, initial: ParameterValues) -> (ParameterValues, bool) {
        let (mut values, mut is_complete) = (initial, true);
        for (_, change) in &self.changes[..count.min(self.changes.len())] {
            match change {
                Change::Set(parameter, value, kind) => {
                    apply_set(&mut values, *parameter, *value, *kind);
                }
                Change::Reset => (values, is_complete) = (initial, true),
                Change::Gap => is_complete = false,
            }
        }
        (values, is_complete)
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
    use sim_contract::{Command, Outcome, Reason};

    use super::*;

    fn outcome(index: u64, step: u64, action: Action) -> OutcomeRow {
        OutcomeRow::from(&Outcome::new(index, step, Command::new(1, index, action), Ok(())))
    }

    fn damping(value: f32) -> Action {
        let parameter = Text::cut("damping");
        Action::Set { parameter, value: ParameterValue::Number(value), constraint_kind: None }
    }

    /// Damping, and whether everything is known.
    fn at(log: &ParameterLog, step: u64) -> (f32, bool) {
        let (values, is_complete) = log.after(log.count_until(step), ParameterValues::default());
        (values.damping, is_complete)
    }

    #[test]
    fn parameters_are_what_was_set_until_a_step() {
        let mut log = ParameterLog::new(0, 0);
        log.add_outcome(&outcome(0, 10, damping(1.0)));
        log.add_outcome(&outcome(1, 20, damping(2.0)));
        log.add_outcome(&outcome(2, 30, Action::Reset));
        assert_eq!([9, 10, 29, 30].map(|step| at(&log, step).0), [0.0, 1.0, 2.0, 0.0]);
        assert!([9, 10, 29, 30].iter().all(|step| at(&log, *step).1));
    }

    #[test]
    fn what_may_be_missing_is_known_again_after_a_reset() {
        let mut log = ParameterLog::new(5, 3);
        log.add_outcome(&outcome(3, 10, Action::Reset));
        log.add_outcome(&outcome(5, 20, damping(2.0)));
        assert_eq!([5, 10, 20].map(|step| at(&log, step).1), [false, true, false]);
    }

    #[test]
    fn what_was_rejected_has_set_nothing() {
        let mut log = ParameterLog::new(0, 0);
        let command = Command::new(1, 0, damping(1.0));
        let rejected = Outcome::new(0, 10, command, Err(Reason::OutOfRange));
        log.add_outcome(&OutcomeRow::from(&rejected));
        assert_eq!(at(&log, 10), (0.0, true));
    }
}
