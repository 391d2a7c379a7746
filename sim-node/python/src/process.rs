//! Values that belong to the process that made them.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::Error;

/// Number of forks between the process that loaded the module and this one. To ask the system for the id of the
/// process would cost as much as an array.
static FORKS: AtomicU32 = AtomicU32::new(0);

/// Counts forks from now on.
pub(crate) fn watch_forks(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let arguments = PyDict::new(py);
    arguments.set_item("after_in_child", wrap_pyfunction!(count_fork, module)?)?;
    py.import("os")?.call_method("register_at_fork", (), Some(&arguments)).map(|_| ())
}

#[pyfunction]
fn count_fork() {
    FORKS.fetch_add(1, Ordering::Relaxed);
}

fn forks() -> u32 {
    FORKS.load(Ordering::Relaxed)
}

/// A locked value with threads, or with ports in shared memory. A fork copies it, but neither its threads nor
/// its place at other processes: the copy must not be used, locked or released.
#[derive(Debug)]
pub(crate) struct OfProcess<T> {
    /// `None` once it is closed.
    value: Mutex<Option<T>>,
    /// Name in errors.
    name: &'static str,
    /// [`FORKS`] in its process.
    forks: u32,
}

impl<T> OfProcess<T> {
    pub(crate) fn new(name: &'static str, value: T) -> Self {
        Self { value: Mutex::new(Some(value)), name, forks: forks() }
    }

    fn is_foreign(&self) -> bool {
        self.forks != forks()
    }

    /// Calls a function with the value.
    ///
    /// # Errors
    /// That of the function; or the value is closed, incomplete, or belongs to a parent process.
    pub(crate) fn with<R>(&self, call: impl FnOnce(&mut T) -> PyResult<R>) -> PyResult<R> {
        let name = self.name;
        if self.is_foreign() {
            return Err(Error::new_err(format!(
                "this {name} was made before a fork: make one in each process, or start processes with \
                 multiprocessing.set_start_method(\"spawn\")"
            )));
        }
        let mut value = whole(&self.value, name)?;
        let value = value.as_mut();
        call(value.ok_or_else(|| Error::new_err(format!("this {name} is closed")))?)
    }

    pub(crate) fn close(&self) {
        if !self.is_foreign() {
            let value = self.value.lock().unwrap_or_else(PoisonError::into_inner).take();
            drop(value);
        }
    }
}

/// Locks a value. A panic of an earlier call has left it incomplete: then this is an error, in every later call.
pub(crate) fn whole<'a, T>(value: &'a Mutex<T>, name: &str) -> PyResult<MutexGuard<'a, T>> {
    value.lock().map_err(|_| {
        Error::new_err(format!(
            "a fault stopped an earlier call of this {name}, so its state is incomplete: make another one"
        ))
    })
}

impl<T> Drop for OfProcess<T> {
    fn drop(&mut self) {
        if self.is_foreign() {
            let value = self.value.get_mut().unwrap_or_else(PoisonError::into_inner).take();
            // It belongs to the parent process.
            Box::leak(Box::new(value));
        }
    }
}
