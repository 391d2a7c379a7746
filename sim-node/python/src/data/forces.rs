//! The forces of a step.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use recording::ForcesRow;
use sim_contract::PlainF32;

use crate::convert::rows;
use crate::error::Error;

/// The impulses of a step on colliders, anchors and fixed particles.
///
/// The arrays are copies. An impulse in N s is the mean force over the step times its duration: `newtons` returns
/// the force.
#[pyclass(frozen, get_all, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Forces {
    /// Number of the step in which the impulses acted.
    step: u64,
    /// Steps per second.
    rate: u32,
    /// Impulses of the particles in contact on each collider.
    colliders: Py<ColliderForces>,
    /// Impulses on each anchor: the sums of those on its particles.
    anchors: Py<AnchorForces>,
    /// Indices of the pinned, grabbed and anchored particles, ascending. Shape: (P,).
    particles: Py<PyArray1<u32>>,
    /// Impulses of constraints, bends and tethers on each of `particles`, in N s. Shape: (P, 3).
    impulses: Py<PyArray2<f32>>,
}

/// The impulses on colliders, by index.
#[pyclass(frozen, get_all, module = "catenary")]
#[derive(Debug)]
pub(crate) struct ColliderForces {
    /// Impulses in N s. Shape: (colliders, 3).
    impulse: Py<PyArray2<f32>>,
    /// Angular impulses about the center of the collider, in N m s. Shape: (colliders, 3).
    angular_impulse: Py<PyArray2<f32>>,
    /// Largest number of particles in contact in one substep. Shape: (colliders,).
    contacts: Py<PyArray1<u32>>,
}

/// The impulses on anchors, by index.
#[pyclass(frozen, get_all, module = "catenary")]
#[derive(Debug)]
pub(crate) struct AnchorForces {
    /// Impulses in N s. Shape: (anchors, 3).
    impulse: Py<PyArray2<f32>>,
    /// Angular impulses about the center of the anchor, in N m s. Shape: (anchors, 3).
    angular_impulse: Py<PyArray2<f32>>,
}

impl Forces {
    pub(crate) fn new(py: Python<'_>, row: &ForcesRow, rate: u32) -> PyResult<Self> {
        let colliders = ColliderForces {
            impulse: vectors(py, row.colliders.iter().map(|one| one.impulse))?,
            angular_impulse: vectors(py, row.colliders.iter().map(|one| one.angular_impulse))?,
            contacts: PyArray1::from_iter(py, row.colliders.iter().map(|one| one.contacts))
                .unbind(),
        };
        let anchors = AnchorForces {
            impulse: vectors(py, row.anchors.iter().map(|one| one.impulse))?,
            angular_impulse: vectors(py, row.anchors.iter().map(|one| one.angular_impulse))?,
        };
        Ok(Self {
            step: row.step,
            rate,
            colliders: Py::new(py, colliders)?,
            anchors: Py::new(py, anchors)?,
            particles: PyArray1::from_slice(py, &row.particles).unbind(),
            impulses: vectors(py, row.impulses.iter().copied())?,
        })
    }
}

fn vectors(
    py: Python<'_>,
    vectors: impl Iterator<Item = [PlainF32; 3]>,
) -> PyResult<Py<PyArray2<f32>>> {
    let vectors: Vec<_> = vectors.map(|vector| vector.map(|number| number.0)).collect();
    Ok(rows(py, &vectors)?.unbind())
}

/// Returns the forces that a node has published.
///
/// # Errors
/// They are of a kind that this module does not know.
pub(crate) fn forces_row(forces: &sim_contract::Forces) -> PyResult<ForcesRow> {
    let unknown =
        || Error::new_err("the node publishes forces of another version: update it or this module");
    ForcesRow::new(forces.header.step, &forces.rows).ok_or_else(unknown)
}

#[pymethods]
impl Forces {
    /// Returns impulses in N s as forces in N, or angular impulses in N m s as torques in N m.
    fn newtons<'py>(&self, impulses: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let numpy = impulses.py().import("numpy")?;
        numpy.call_method1("multiply", (impulses, f64::from(self.rate)))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!(
            "<catenary.Forces of step {}: {} colliders, {} anchors, {} particles>",
            self.step,
            self.colliders.get().__len__(py)?,
            self.anchors.get().__len__(py)?,
            self.particles.bind(py).len()?
        ))
    }
}

#[pymethods]
impl ColliderForces {
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.contacts.bind(py).len()
    }
}

#[pymethods]
impl AnchorForces {
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.impulse.bind(py).len()
    }
}
