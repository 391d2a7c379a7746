//! Whole numbers as arguments. An error names the argument and its range.

use std::fmt::Display;
use std::ops::RangeInclusive;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::convert::shown;

/// Returns the value of an argument.
pub(crate) fn whole<'py, T>(
    value: &Bound<'py, PyAny>,
    name: &str,
    range: &RangeInclusive<T>,
) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error = PyErr> + PartialOrd + Display,
{
    let (start, end) = (range.start(), range.end());
    match value.extract::<T>() {
        Ok(number) if range.contains(&number) => Ok(number),
        Err(error) if error.is_instance_of::<PyTypeError>(value.py()) => {
            let message = format!("`{name}` must be a whole number, not {}", shown(value));
            Err(PyTypeError::new_err(message))
        }
        _ => {
            let message = format!("`{name}` is {} (allowed: {start} to {end})", shown(value));
            Err(PyValueError::new_err(message))
        }
    }
}

/// Defines a function for each argument, which returns its value.
macro_rules! arguments {
    ($($function:ident $name:literal: $number:ty, $range:expr;)*) => {
        $(pub(crate) fn $function(value: &Bound<'_, PyAny>) -> PyResult<$number> {
            whole(value, $name, &$range)
        })*
    };
}

/// Defines a function for each argument that may be None.
macro_rules! optional_arguments {
    ($($function:ident $name:literal: $number:ty, $range:expr;)*) => {
        $(pub(crate) fn $function(value: &Bound<'_, PyAny>) -> PyResult<Option<$number>> {
            let value = (!value.is_none()).then_some(value);
            value.map(|value| whole(value, $name, &$range)).transpose()
        })*
    };
}

arguments! {
    count "count": u64, 0..=u64::MAX;
    sequence "sequence": u64, 0..=u64::MAX;
    every "every": u32, 1..=u32::MAX;
    step "step": u64, 0..=u64::MAX;
    threads "threads": usize, 1..=usize::from(sim_solver::THREADS_MAX);
}

optional_arguments! {
    client_id "client_id": u64, 0..=sim_contract::CLIENT_ID_END - 1;
    start "start": u64, 0..=u64::MAX;
    stop "stop": u64, 0..=u64::MAX;
}
