//! The proof of a recording.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use recording::verification::{Difference, StepRange, Verdict, VerifyOptions, VerifyReport};
use recording::{LogReader, Wanted, find_state};
use sim_host::Stop;

use crate::arguments;
use crate::error::recording_error;
use crate::patience::run_until_signal;

/// Simulates a recording again and compares every state, up to the first difference.
///
/// `start` is the first step to compare, and `stop` the step after the last one. The simulation starts at the
/// last complete state up to `start`. `threads` parts of the recording are simulated at the same time. Other threads of
/// the interpreter run meanwhile; Ctrl-C ends it.
///
/// Raises `RecordingError` if the file cannot be read, or has no complete state to start from.
#[pyfunction]
#[pyo3(signature = (path, *, start=None, stop=None, threads=1))]
pub(crate) fn verify(
    py: Python<'_>,
    path: PathBuf,
    #[pyo3(from_py_with = arguments::start)] start: Option<u64>,
    #[pyo3(from_py_with = arguments::stop)] stop: Option<u64>,
    #[pyo3(from_py_with = arguments::threads)] threads: usize,
) -> PyResult<Verification> {
    let first = start.unwrap_or(0);
    if let Some(stop) = stop.filter(|stop| *stop <= first) {
        let message = format!("`stop` is {stop} (allowed: more than `start`, which is {first})");
        return Err(PyValueError::new_err(message));
    }
    let range = StepRange { start: first, last: stop.map_or(u64::MAX, |stop| stop - 1) };
    let options = VerifyOptions { threads, range };
    let report = run_until_signal(py, |signal| verify_file(&path, options, signal))??;
    match report.last_identical_step {
        Some(last) if last < first && report.verdict == Verdict::Identical => {
            let path = path.display();
            let message = format!("`start` is {first}, but the last step of {path} is {last}");
            Err(PyValueError::new_err(message))
        }
        _ => Ok(Verification(report)),
    }
}

/// Verifies the steps of a range, from the last complete state up to its start.
fn verify_file(path: &Path, options: VerifyOptions, signal: &Stop) -> PyResult<VerifyReport> {
    let open = || LogReader::open_until(path, signal).map_err(|e| recording_error(path, &e));
    let VerifyOptions { threads, mut range } = options;
    if range.start > 0 {
        let place = find_state(open()?, Wanted::UpTo(range.start));
        range.start = place.map_err(|error| recording_error(path, &error))?.keyframe_step;
    }
    let options = VerifyOptions { threads, range };
    let report = recording::verification::verify(open()?, options, signal.flag(), |_| ());
    report.map_err(|error| recording_error(path, &error))
}

/// The result of `verify`.
#[pyclass(frozen, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Verification(VerifyReport);

impl Verification {
    fn difference(&self) -> Option<&Difference> {
        self.0.difference.as_ref()
    }
}

#[pymethods]
impl Verification {
    /// True if every compared bit is equal, and the file does not end too early.
    #[getter]
    fn is_identical(&self) -> bool {
        self.0.verdict == Verdict::Identical && self.0.incomplete_end().is_none()
    }

    /// Result: "identical", "diverged", or "outcome_log_incomplete" if steps that depend on missing outcomes
    /// could not be compared, and all others are identical.
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.0.verdict {
            Verdict::Identical => "identical",
            Verdict::Diverged => "diverged",
            Verdict::OutcomeLogIncomplete => "outcome_log_incomplete",
            Verdict::Interrupted => "interrupted",
        }
    }

    /// Step that the simulation started from.
    #[getter]
    fn first_step(&self) -> u64 {
        self.0.first_step
    }

    /// Last bit-identical step, if there is one.
    #[getter]
    fn last_identical_step(&self) -> Option<u64> {
        self.0.last_identical_step
    }

    /// Number of simulated and bit-identical steps.
    #[getter]
    fn steps_identical(&self) -> u64 {
        self.0.steps_identical
    }

    /// First and last step of each gap, where outcomes are missing.
    #[getter]
    fn gaps(&self) -> Vec<(u64, u64)> {
        self.0.gaps.iter().map(|gap| (gap.from, gap.to)).collect()
    }

    /// First step that differs, or that may lack an outcome.
    #[getter]
    fn step(&self) -> Option<u64> {
        self.0.step
    }

    /// First particle of that step that differs, if its particles do.
    #[getter]
    fn particle(&self) -> Option<usize> {
        self.difference().map(|difference| difference.particle)
    }

    /// First field of that particle that differs, such as "position x".
    #[getter]
    fn field(&self) -> Option<&'static str> {
        self.difference().map(|difference| difference.field)
    }

    /// Description of the difference or of the missing outcome.
    #[getter]
    fn what(&self) -> Option<&str> {
        self.0.what.as_deref()
    }

    /// End of the file, such as "complete".
    #[getter]
    fn end(&self) -> String {
        self.0.end.as_ref().map_or_else(|| "not reached".to_owned(), ToString::to_string)
    }

    /// Number of messages that the recording lacks, by topic.
    #[getter]
    fn lost(&self) -> BTreeMap<&'static str, u64> {
        self.0.lost.clone()
    }

    /// Content that was not compared, because the file has it only once.
    #[getter]
    fn not_covered(&self) -> Vec<String> {
        self.0.not_covered.clone()
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<catenary.Verification: {}>", self.0)
    }
}
