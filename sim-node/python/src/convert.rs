//! Values between Python and Rust.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBool, PyType};
use serde::Serialize;
use sim_contract::{ParameterValue, ParticleState};

use crate::error::Error;

/// `N` numbers from any Python sequence, also a NumPy array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers<const N: usize>(pub(crate) [f32; N]);

/// Three coordinates.
pub(crate) type Vector = Numbers<3>;

impl<'py, const N: usize> FromPyObject<'_, 'py> for Numbers<N> {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let wrong = || PyTypeError::new_err(format!("expected {N} numbers, got {}", shown(&value)));
        let mut numbers = [0.0; N];
        let mut items = value.try_iter().map_err(|_| wrong())?;
        for number in &mut numbers {
            let item = items.next().ok_or_else(wrong)??;
            *number = item.extract().map_err(|_| wrong())?;
        }
        if items.next().is_some() {
            return Err(wrong());
        }
        Ok(Self(numbers))
    }
}

pub(crate) fn shown(value: &Bound<'_, PyAny>) -> String {
    value.repr().map_or_else(|_| "something else".to_owned(), |text| text.to_string())
}

/// Returns the value of a parameter: `None` is off.
pub(crate) fn parameter_value(value: &Bound<'_, PyAny>) -> PyResult<ParameterValue> {
    if value.is_none() {
        return Ok(ParameterValue::Off);
    }
    if !value.is_instance_of::<PyBool>() {
        if let Ok(number) = value.extract::<f32>() {
            return Ok(ParameterValue::Number(number));
        }
        if let Ok(Numbers(vector)) = value.extract::<Vector>() {
            return Ok(ParameterValue::Vector(vector));
        }
    }
    let message = format!("expected a number, 3 numbers or None (off), got {}", shown(value));
    Err(PyTypeError::new_err(message))
}

/// Returns a hash as `numpy.uint64`: arrays, and the `info` of Gymnasium, would not keep all bits of an `int`.
pub(crate) fn hash(py: Python<'_>, hash: u64) -> PyResult<Bound<'_, PyAny>> {
    static UINT64: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    UINT64.import(py, "numpy", "uint64")?.call1((hash,))
}

/// Returns a hash as recordings and `sim-node ctl hash` write it.
pub(crate) fn hash_hex(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Returns the Python form of a value that recordings store as JSON: dicts, lists and plain values.
pub(crate) fn from_json<'py>(
    py: Python<'py>,
    value: &impl Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|error| Error::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Returns an array of its own memory with `N` columns.
pub(crate) fn rows<'py, T: numpy::Element + bytemuck::Pod, const N: usize>(
    py: Python<'py>,
    rows: &[[T; N]],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let flat = PyArray1::from_slice(py, bytemuck::cast_slice(rows));
    flat.reshape([rows.len(), N])
}

/// Returns an array of the shape (particles, 3) as rows.
fn vectors(name: &str, array: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; 3]>> {
    let numpy = array.py().import("numpy")?;
    let array = numpy.call_method1("ascontiguousarray", (array, numpy.getattr("float32")?))?;
    let array = array.cast_into::<PyArray2<f32>>().ok().filter(|array| array.dims()[1] == 3);
    let wrong = || PyValueError::new_err(format!("`{name}` must have the shape (particles, 3)"));
    let numbers = array.ok_or_else(wrong)?.to_vec().map_err(|_| wrong())?;
    Ok(bytemuck::cast_slice(&numbers).to_vec())
}

/// Returns particles that have only positions and velocities.
pub(crate) fn motion(
    positions: &Bound<'_, PyAny>,
    velocities: &Bound<'_, PyAny>,
) -> PyResult<Vec<ParticleState>> {
    let (positions, velocities) =
        (vectors("positions", positions)?, vectors("velocities", velocities)?);
    if positions.len() != velocities.len() {
        return Err(PyValueError::new_err(format!(
            "there are {} positions, but {} velocities",
            positions.len(),
            velocities.len()
        )));
    }
    let pairs = positions.into_iter().zip(velocities);
    let particle =
        |(position, velocity)| ParticleState { position, velocity, ..ParticleState::default() };
    Ok(pairs.map(particle).collect())
}
