//! Outcomes of commands.

use pyo3::prelude::*;
use recording::OutcomeRow;
use sim_contract::{Action, Reason};

use crate::convert::from_json;
use crate::error::Rejected;

/// The answer to a command.
#[pyclass(frozen, module = "catenary")]
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    outcome: sim_contract::Outcome,
    /// The allowed values of a rejected command, as far as they are known.
    allowed: Option<String>,
}

impl Outcome {
    /// Makes an outcome whose error names the values that the action allows.
    pub(crate) fn new(outcome: &sim_contract::Outcome) -> Self {
        let action = outcome.command.action();
        let allowed = outcome.reason().and_then(|reason| action.allowed_values(reason));
        Self { outcome: *outcome, allowed }
    }

    /// Adds the allowed indices to the error of an unknown one.
    pub(crate) fn with_allowed(self, allowed: Option<String>) -> Self {
        Self { allowed: self.allowed.or(allowed), ..self }
    }

    /// Returns the outcome of an applied command.
    ///
    /// # Errors
    /// The command was rejected.
    pub(crate) fn require_applied(self, py: Python<'_>) -> PyResult<Self> {
        if self.outcome.is_applied() {
            return Ok(self);
        }
        let row = OutcomeRow::from(&self.outcome);
        let cause = cause(self.outcome.reason(), self.allowed.as_deref(), &row.action);
        let message = format!("rejected at step {}: {cause}", row.step);
        Err(rejected(py, message, self.outcome.reason(), Some(self)))
    }
}

/// Returns the text of a rejection: the meaning of its reason, the allowed values and the action.
pub(crate) fn cause(reason: Option<Reason>, allowed: Option<&str>, action: &Action) -> String {
    let meaning = reason.map_or_else(|| "for an unknown reason".to_owned(), |one| one.to_string());
    let remedy = match (allowed, reason) {
        (Some(allowed), _) => Some(format!("allowed: {allowed}")),
        (None, Some(Reason::NoEffectHere)) => missing_condition(action).map(ToOwned::to_owned),
        _ => None,
    };
    let remedy = remedy.map_or_else(String::new, |remedy| format!(" ({remedy})"));
    let action = serde_json::to_string(action).unwrap_or_default();
    format!("{meaning}{remedy}: {action}")
}

/// Returns the condition under which an action has an effect, in words.
fn missing_condition(action: &Action) -> Option<&'static str> {
    Some(match action {
        Action::Step { .. } => "the node runs; pause() pauses it",
        Action::Pin { .. }
        | Action::Unpin { .. }
        | Action::Grab { .. }
        | Action::Move { .. }
        | Action::Release { .. } => "the particle is frozen; reset() restores it",
        _ => return action.missing_condition(),
    })
}

/// Returns the indices of `count` elements in words.
pub(crate) fn indices(count: usize) -> String {
    match count {
        0 => "none, because there is none".to_owned(),
        1 => "0".to_owned(),
        count => format!("0 to {}", count - 1),
    }
}

/// Returns the exception for a rejected command.
pub(crate) fn rejected(
    py: Python<'_>,
    message: String,
    reason: Option<Reason>,
    outcome: Option<Outcome>,
) -> PyErr {
    let name = reason.map_or("unknown", Reason::name);
    match outcome.map(|outcome| Py::new(py, outcome)).transpose() {
        Ok(outcome) => Rejected::new_err((message, name, outcome)),
        Err(error) => error,
    }
}

#[pymethods]
impl Outcome {
    /// True if the command took effect; False if it was rejected and changed nothing.
    #[getter]
    fn is_applied(&self) -> bool {
        self.outcome.is_applied()
    }

    /// Name of the reason of a rejection, such as "unknown_particle".
    #[getter]
    fn reason(&self) -> Option<&'static str> {
        (!self.outcome.is_applied()).then(|| self.outcome.reason_name())
    }

    /// First step that shows the effect.
    #[getter]
    fn step(&self) -> u64 {
        self.outcome.step
    }

    /// Number of the outcome in its run, without gaps.
    #[getter]
    fn index(&self) -> u64 {
        self.outcome.index
    }

    /// Number of the command among those of its client.
    #[getter]
    fn sequence(&self) -> u64 {
        self.outcome.command.sequence
    }

    /// Id of the client that sent the command.
    #[getter]
    fn client_id(&self) -> u64 {
        self.outcome.command.client_id
    }

    /// The command as recordings store it: "kind" and its fields.
    #[getter]
    fn command<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.outcome.command.action())
    }

    /// Raises `Rejected` if the command was rejected.
    #[pyo3(name = "require_applied")]
    fn require_applied_now(&self, py: Python<'_>) -> PyResult<()> {
        self.clone().require_applied(py).map(|_| ())
    }

    /// True for a load that began a new run.
    #[getter]
    fn begins_run(&self) -> bool {
        self.outcome.begins_run()
    }

    fn __repr__(&self) -> String {
        let row = OutcomeRow::from(&self.outcome);
        let action = serde_json::to_string(&row.action).unwrap_or_default();
        let reason =
            if row.reason.is_empty() { String::new() } else { format!(", {}", row.reason) };
        format!("<catenary.Outcome: {} at step {}{reason}: {action}>", row.status, row.step)
    }
}
