//! Outcomes of commands.

use pyo3::prelude::*;
use recorder::OutcomeRow;
use sim_contract::Reason;

use crate::convert::from_json;
use crate::error::Rejected;

/// The answer to a command.
#[pyclass(frozen, module = "catenary")]
#[derive(Debug, Clone)]
pub(crate) struct Outcome(pub(crate) sim_contract::Outcome);

impl Outcome {
    /// Returns the outcome of an applied command.
    ///
    /// # Errors
    /// The command was rejected.
    pub(crate) fn require_applied(self, py: Python<'_>) -> PyResult<Self> {
        if self.0.is_applied() {
            return Ok(self);
        }
        let reason = self.0.reason();
        let meaning =
            reason.map_or_else(|| "for an unknown reason".to_owned(), |one| one.to_string());
        let row = OutcomeRow::from(&self.0);
        let action = serde_json::to_string(&row.action).unwrap_or_default();
        let message = format!("rejected at step {}: {meaning}: {action}", row.step);
        Err(rejected(py, message, reason, Some(self)))
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
        self.0.is_applied()
    }

    /// Name of the reason of a rejection, such as "unknown_particle".
    #[getter]
    fn reason(&self) -> Option<&'static str> {
        (!self.0.is_applied()).then(|| self.0.reason_name())
    }

    /// First step that shows the effect.
    #[getter]
    fn step(&self) -> u64 {
        self.0.step
    }

    /// Number of the outcome in its run, without gaps.
    #[getter]
    fn index(&self) -> u64 {
        self.0.index
    }

    /// Number of the command among those of its client.
    #[getter]
    fn sequence(&self) -> u64 {
        self.0.command.sequence
    }

    /// Id of the client that sent the command.
    #[getter]
    fn client_id(&self) -> u64 {
        self.0.command.client_id
    }

    /// The command as recordings store it: "kind" and its fields.
    #[getter]
    fn command<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.0.command.action())
    }

    /// Raises `Rejected` if the command was rejected.
    #[pyo3(name = "require_applied")]
    fn require_applied_now(&self, py: Python<'_>) -> PyResult<()> {
        self.clone().require_applied(py).map(|_| ())
    }

    /// True for a load that began a new run.
    #[getter]
    fn begins_run(&self) -> bool {
        self.0.begins_run()
    }

    fn __repr__(&self) -> String {
        let row = OutcomeRow::from(&self.0);
        let action = serde_json::to_string(&row.action).unwrap_or_default();
        let reason =
            if row.reason.is_empty() { String::new() } else { format!(", {}", row.reason) };
        format!("<catenary.Outcome: {} at step {}{reason}: {action}>", row.status, row.step)
    }
}
