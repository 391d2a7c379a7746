//! Scenes, and what stays the same until the next load.

use std::path::Path;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use recording::LogReader;
use sim_contract::{BendState, ConstraintState, LoadHeader, Method, Triangle};
use sim_host::read_scene_file;
use sim_solver::{Scene, SceneError, builtin};

use crate::convert::{hash, rows};
use crate::error::{SceneError as PythonSceneError, load_error, recording_error};

/// Returns the names of the built-in scenes.
#[pyfunction]
pub(crate) fn scene_names() -> Vec<&'static str> {
    builtin::names().collect()
}

/// Loads a scene: a built-in one, a file, or the scene of a recording.
pub(crate) fn load_scene(source: &str) -> PyResult<Scene> {
    if Path::new(source).extension() != Some("mcap".as_ref()) {
        let read = |path: &Path| read_scene_file(path).map_err(|error| error.to_string());
        return Scene::load(source, &read).map_err(|error| load_error(&error));
    }
    let path = Path::new(source);
    let log = LogReader::open(path).map_err(|error| recording_error(path, &error))?;
    let text = String::from_utf8_lossy(log.scene());
    Scene::from_toml(&text, source).map_err(|error| scene_error(&error))
}

pub(crate) fn scene_error(error: &SceneError) -> PyErr {
    PythonSceneError::new_err(error.list())
}

/// The constraints of a scene, as loaded.
#[pyclass(frozen, get_all, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Topology {
    /// Indices of the two particles of each constraint. Shape: (constraints, 2).
    ends: Py<PyArray2<u32>>,
    /// Rest lengths in metres. Shape: (constraints,).
    rest_lengths: Py<PyArray1<f32>>,
    /// Compliances in m/N, or stiffnesses from 0 to 1 with method "pbd". Shape: (constraints,).
    compliances: Py<PyArray1<f32>>,
    /// Kinds: indices into CONSTRAINT_KINDS. Shape: (constraints,).
    kinds: Py<PyArray1<u32>>,
    /// Origin of all positions, in metres.
    origin: [f64; 3],
    /// Steps per second.
    rate: u32,
    /// Method of the solver.
    method: &'static str,
    /// Hash of the scene: a state belongs to the scene with the same one.
    scene_hash: Py<PyAny>,
}

impl Topology {
    pub(crate) fn new(
        py: Python<'_>,
        header: &LoadHeader,
        constraints: &[ConstraintState],
    ) -> PyResult<Self> {
        let ends: Vec<_> = constraints.iter().map(|one| [one.a, one.b]).collect();
        Ok(Self {
            ends: rows(py, &ends)?.unbind(),
            rest_lengths: column(py, constraints, |one| one.rest_length),
            compliances: column(py, constraints, |one| one.compliance),
            kinds: column(py, constraints, |one| one.kind),
            origin: header.origin,
            rate: header.rate_hz,
            method: Method::from_number(header.method).map_or("unknown", Method::name),
            scene_hash: hash(py, header.scene_hash)?.unbind(),
        })
    }
}

fn column<S, T: numpy::Element>(
    py: Python<'_>,
    states: &[S],
    field: impl Fn(&S) -> T,
) -> Py<PyArray1<T>> {
    PyArray1::from_iter(py, states.iter().map(field)).unbind()
}

#[pymethods]
impl Topology {
    fn __len__(&self, py: Python<'_>) -> usize {
        self.kinds.bind(py).len().unwrap_or(0)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<catenary.Topology: {} constraints>", self.__len__(py))
    }
}

/// The bends of a scene, as loaded: resistance to curvature.
///
/// With C the sum of c x over the particles of a bend, its energy in J is |C - rest n|^2 rigidity / (2 geometry).
/// For the positions p0 to p3 of a hinge, n is the unit vector along the sum of the unit normals of its triangles,
/// along (p2 - p1) x (p0 - p1) and (p3 - p1) x (p2 - p1).
#[pyclass(frozen, get_all, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Bends {
    /// Indices of the four particles of each bend. The fourth of a bend of three is its second one again.
    /// Shape: (bends, 4).
    particles: Py<PyArray2<u32>>,
    /// Coefficients c of the particles. The fourth of a bend of three is 0. Shape: (bends, 4).
    coefficients: Py<PyArray2<f32>>,
    /// Compliances times rigidities: m² on a surface, m³ on a line. Shape: (bends,).
    geometries: Py<PyArray1<f32>>,
    /// Bending rigidities of the scene: N m on a surface, N m² on a line. Shape: (bends,).
    rigidities: Py<PyArray1<f32>>,
    /// C along n at rest in metres; other than 0 only for hinges that are folded at rest. Shape: (bends,).
    rests: Py<PyArray1<f32>>,
    /// Shapes: indices into BEND_SHAPES. Shape: (bends,).
    shapes: Py<PyArray1<u32>>,
    /// Indices of the [[generate]] blocks that they come from; -1 for explicit bends. Shape: (bends,).
    blocks: Py<PyArray1<i32>>,
}

impl Bends {
    pub(crate) fn new(py: Python<'_>, bends: &[BendState]) -> PyResult<Self> {
        let particles: Vec<_> = bends.iter().map(|one| one.particles).collect();
        let coefficients: Vec<_> = bends.iter().map(|one| one.coefficients).collect();
        Ok(Self {
            particles: rows(py, &particles)?.unbind(),
            coefficients: rows(py, &coefficients)?.unbind(),
            geometries: column(py, bends, |one| one.geometry),
            rigidities: column(py, bends, |one| one.rigidity),
            rests: column(py, bends, |one| one.rest),
            shapes: column(py, bends, |one| one.shape),
            blocks: column(py, bends, |one| one.block),
        })
    }
}

#[pymethods]
impl Bends {
    fn __len__(&self, py: Python<'_>) -> usize {
        self.shapes.bind(py).len().unwrap_or(0)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<catenary.Bends: {} bends>", self.__len__(py))
    }
}

/// Returns the corners of triangles as an array of the shape (triangles, 3).
pub(crate) fn corners<'py>(
    py: Python<'py>,
    triangles: &[Triangle],
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    rows(py, &triangles.iter().map(|triangle| triangle.corners).collect::<Vec<_>>())
}
