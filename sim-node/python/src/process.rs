//! Values that belong to the process that made them.

use std::process;
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;

use crate::error::Error;

/// A locked value with threads, or with ports in shared memory. A fork copies it, but neither its threads nor
/// its place at other processes: the copy must not be used, locked or released.
#[derive(Debug)]
pub(crate) struct OfProcess<T> {
    /// `None` once it is closed.
    value: Mutex<Option<T>>,
    /// Name in errors.
    name: &'static str,
    process_id: u32,
}

impl<T> OfProcess<T> {
    pub(crate) fn new(name: &'static str, value: T) -> Self {
        Self { value: Mutex::new(Some(value)), name, process_id: process::id() }
    }

    fn is_foreign(&self) -> bool {
        self.process_id != process::id()
    }

    /// Calls a function with the value.
    ///
    /// # Errors
    /// That of the function; or the value is closed, or belongs to a parent process.
    pub(crate) fn with<R>(&self, call: impl FnOnce(&mut T) -> PyResult<R>) -> PyResult<R> {
        let name = self.name;
        if self.is_foreign() {
            return Err(Error::new_err(format!(
                "this {name} was made before a fork: make one in each process, or start processes with \
                 multiprocessing.set_start_method(\"spawn\")"
            )));
        }
        let mut value = self.value.lock().unwrap_or_else(PoisonError::into_inner);
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

impl<T> Drop for OfProcess<T> {
    fn drop(&mut self) {
        if self.is_foreign() {
            let value = self.value.get_mut().unwrap_or_else(PoisonError::into_inner).take();
            // It belongs to the parent process.
            Box::leak(Box::new(value));
        }
    }
}
