//! The parameters at each step of a recording: those of its scene, changed by the recorded commands.

use recorder::OutcomeRow;
use sim_contract::{Action, KindFilter, Parameter, ParameterValue, ParameterValues, Setting, Text};

/// Changes in a recording: hours of moving a slider. Later ones count as lost.
const CHANGES_MAX: usize = 1 << 18;

/// The changes of the parameters in a recording, in order.
#[derive(Debug, Clone)]
pub(super) struct ParameterLog {
    changes: Vec<Change>,
    next_index: u64,
}

#[derive(Debug, Clone, Copy)]
struct Change {
    step: u64,
    kind: ChangeKind,
}

#[derive(Debug, Clone, Copy)]
enum ChangeKind {
    Set {
        parameter: Text,
        value: ParameterValue,
        kind: Option<KindFilter>,
    },
    /// All parameters return to their values in the scene.
    Reset,
    /// The recording may have lost changes.
    Gap,
}

/// Parameters at a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoggedParameters {
    pub(super) values: ParameterValues,
    /// No change before the step was lost.
    pub(super) is_complete: bool,
}

impl ParameterLog {
    /// Creates the log of a recording whose first state includes `outcome_count` outcomes.
    pub(super) fn new(first_step: u64, outcome_count: u64) -> Self {
        let mut log = Self { changes: Vec::new(), next_index: outcome_count };
        if outcome_count > 0 {
            log.add_gap(first_step);
        }
        log
    }

    /// Adds the next outcome of the recording.
    pub(super) fn add_outcome(&mut self, row: &OutcomeRow) {
        if row.index > self.next_index {
            self.add_gap(row.step);
        }
        self.next_index = row.index + 1;
        let kind = match row.action {
            Action::Set { parameter, value, constraint_kind } => {
                ChangeKind::Set { parameter, value, kind: constraint_kind }
            }
            Action::Reset => ChangeKind::Reset,
            _ => return,
        };
        if row.is_applied() {
            self.add(Change { step: row.step, kind });
        }
    }

    /// Notes that a part of the recording from about this step on is unreadable.
    pub(super) fn add_gap(&mut self, step: u64) {
        self.add(Change { step, kind: ChangeKind::Gap });
    }

    fn add(&mut self, change: Change) {
        if self.changes.len() < CHANGES_MAX {
            self.changes.push(change);
        } else if let Some(last) = self.changes.last_mut() {
            last.kind = ChangeKind::Gap;
        }
    }

    /// Number of changes up to a step. The parameters depend on it only.
    pub(super) fn count_until(&self, step: u64) -> usize {
        self.changes.iter().take_while(|change| change.step <= step).count()
    }

    /// Parameters after the first `count` changes. `initial` are those of the scene.
    pub(super) fn after(&self, count: usize, initial: ParameterValues) -> LoggedParameters {
        let mut parameters = LoggedParameters { values: initial, is_complete: true };
        for change in self.changes.iter().take(count) {
            match change.kind {
                ChangeKind::Set { parameter, value, kind } => {
                    apply_set(&mut parameters.values, parameter, value, kind);
                }
                ChangeKind::Reset => {
                    parameters = LoggedParameters { values: initial, is_complete: true };
                }
                ChangeKind::Gap => parameters.is_complete = false,
            }
        }
        parameters
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

    fn at(log: &ParameterLog, step: u64) -> LoggedParameters {
        log.after(log.count_until(step), ParameterValues::default())
    }

    #[test]
    fn parameters_have_the_values_that_were_set_up_to_a_step() {
        let mut log = ParameterLog::new(0, 0);
        log.add_outcome(&outcome(0, 10, damping(1.0)));
        log.add_outcome(&outcome(1, 20, damping(2.0)));
        log.add_outcome(&outcome(2, 30, Action::Reset));
        assert_eq!([9, 10, 29, 30].map(|step| at(&log, step).values.damping), [0.0, 1.0, 2.0, 0.0]);
        assert!([9, 10, 29, 30].iter().all(|step| at(&log, *step).is_complete));
    }

    #[test]
    fn after_a_gap_the_parameters_are_complete_again_from_the_next_reset_on() {
        let mut log = ParameterLog::new(5, 3);
        log.add_outcome(&outcome(3, 10, Action::Reset));
        log.add_outcome(&outcome(5, 20, damping(2.0)));
        assert_eq!([5, 10, 20].map(|step| at(&log, step).is_complete), [false, true, false]);
    }

    #[test]
    fn a_rejected_command_changes_no_parameter() {
        let mut log = ParameterLog::new(0, 0);
        let command = Command::new(1, 0, damping(1.0));
        let rejected = Outcome::new(0, 10, command, Err(Reason::OutOfRange));
        log.add_outcome(&OutcomeRow::from(&rejected));
        let expected = LoggedParameters { values: ParameterValues::default(), is_complete: true };
        assert_eq!(at(&log, 10), expected);
    }
}
