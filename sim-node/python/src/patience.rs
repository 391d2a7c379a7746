//! Waiting in parts, so that Ctrl-C ends every wait.

use std::time::Duration;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sim_contract::clock::monotonic_ns;

/// Longest time without a look at signals.
pub(crate) const PART: Duration = Duration::from_millis(50);

/// The rest of a wait.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patience {
    /// `None` waits without limit.
    end_ns: Option<u64>,
}

impl Patience {
    /// Returns the wait for a timeout in seconds; `None` waits without limit.
    ///
    /// # Errors
    /// The timeout is negative or NaN.
    pub(crate) fn new(timeout_s: Option<f64>) -> PyResult<Self> {
        let Some(timeout_s) = timeout_s else { return Ok(Self { end_ns: None }) };
        if timeout_s.is_nan() || timeout_s < 0.0 {
            let message =
                format!("the timeout is {timeout_s} (allowed: 0 or more seconds, or None)");
            return Err(PyValueError::new_err(message));
        }
        let end_ns = Duration::try_from_secs_f64(timeout_s)
            .ok()
            .and_then(|timeout| u64::try_from(timeout.as_nanos()).ok())
            .and_then(|timeout_ns| monotonic_ns().checked_add(timeout_ns));
        Ok(Self { end_ns })
    }

    /// Returns the next part of the wait; zero at the end.
    pub(crate) fn part(self) -> Duration {
        let remaining = |end_ns: u64| Duration::from_nanos(end_ns.saturating_sub(monotonic_ns()));
        self.end_ns.map_or(PART, |end_ns| remaining(end_ns).min(PART))
    }

    /// Returns `true` if the time has passed.
    pub(crate) fn is_over(self) -> bool {
        self.end_ns.is_some_and(|end_ns| monotonic_ns() >= end_ns)
    }
}

/// Returns a timeout for a call that waits in one piece.
///
/// # Errors
/// The timeout is negative or NaN.
pub(crate) fn whole(timeout_s: f64) -> PyResult<Duration> {
    Patience::new(Some(timeout_s))?;
    Ok(Duration::try_from_secs_f64(timeout_s).unwrap_or(Duration::MAX))
}

/// Calls `attempt` with parts of the wait until it returns a value. Between two calls, other threads run
/// and signals are handled. `None` if the time has passed.
///
/// # Errors
/// The error of `attempt`, or the exception of a signal handler such as `KeyboardInterrupt`.
pub(crate) fn wait<T: Send>(
    py: Python<'_>,
    patience: Patience,
    mut attempt: impl FnMut(Duration) -> PyResult<Option<T>> + Send,
) -> PyResult<Option<T>> {
    loop {
        let part = patience.part();
        if let Some(value) = py.detach(|| attempt(part))? {
            return Ok(Some(value));
        }
        py.check_signals()?;
        if patience.is_over() {
            return Ok(None);
        }
    }
}
