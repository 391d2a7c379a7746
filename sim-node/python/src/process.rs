//! Values that belong to the process that made them.

use std::process;

use pyo3::prelude::*;

use crate::error::Error;

/// A value with ports in shared memory. A fork copies the value, but not the ports' connections: the copy
/// must neither be used nor release them.
#[derive(Debug)]
pub(crate) struct OfProcess<T> {
    /// `None` once it is closed.
    value: Option<T>,
    process_id: u32,
}

impl<T> OfProcess<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { value: Some(value), process_id: process::id() }
    }

    /// Returns the value.
    ///
    /// # Errors
    /// It is closed, or belongs to a parent process.
    pub(crate) fn get(&mut self) -> PyResult<&mut T> {
        if self.process_id != process::id() {
            return Err(Error::new_err(
                "this node was attached before a fork: attach again in each process, or start \
                 processes with multiprocessing.set_start_method(\"spawn\")",
            ));
        }
        self.value.as_mut().ok_or_else(|| Error::new_err("this node is closed"))
    }

    /// Returns the value also in a process that a fork has made; `None` once it is closed.
    pub(crate) fn peek(&self) -> Option<&T> {
        self.value.as_ref()
    }

    pub(crate) fn close(&mut self) {
        let value = self.value.take();
        if self.process_id != process::id() {
            // The ports belong to the parent process.
            Box::leak(Box::new(value));
        }
    }
}

impl<T> Drop for OfProcess<T> {
    fn drop(&mut self) {
        self.close();
    }
}
