//! Waiting in parts, so that Ctrl-C ends every wait and all work.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sim_contract::RequestError;
use sim_host::Stop;
use sim_host::clock::monotonic_ns;

use crate::error::Error;

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

/// Runs long work on a thread of its own, while this one handles signals and other threads of the interpreter
/// run. After a signal whose handler raises, `work` finds its `Stop` requested and must end soon.
///
/// # Errors
/// The exception of a signal handler such as `KeyboardInterrupt`.
pub(crate) fn run_until_signal<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> T + Send,
) -> PyResult<T> {
    let stop = &Stop::default();
    let (sender, mut receiver) = channel();
    thread::scope(|scope| {
        scope.spawn(move || sender.send(work(stop)).is_ok());
        let mut raised = None;
        loop {
            let receiver = &mut receiver;
            match py.detach(move || receiver.recv_timeout(PART)) {
                Ok(result) => return raised.map_or(Ok(result), Err),
                // The work has panicked, and so will this thread at the end of the scope.
                Err(RecvTimeoutError::Disconnected) => return Err(Error::new_err("panicked")),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if let Err(error) = py.check_signals() {
                stop.flag().store(true, Ordering::Relaxed);
                raised = Some(error);
            }
        }
    })
}

/// Returns the error of the last part of a wait as that of the whole wait.
pub(crate) fn with_timeout(error: RequestError, timeout_s: Option<f64>) -> RequestError {
    let total = timeout_s.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    let total = total.unwrap_or(PART);
    match error {
        RequestError::Timeout { sequence, owner, .. } => {
            RequestError::Timeout { sequence, timeout: total, owner }
        }
        RequestError::OutcomesMissed { sequence, missed_count, .. } => {
            RequestError::OutcomesMissed { sequence, timeout: total, missed_count }
        }
        other => other,
    }
}
