//! Complete states, which can be kept, sent to another process and put in place.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sim_contract::{Change, Endpoint, GivenState, ParticleState, Tap};
use sim_solver::Keyframe;

use crate::convert::{hash, hash_hex};
use crate::error::{StateError, Timeout, attach_error};
use crate::patience::{Patience, wait};

/// A complete state of a scene: it can be pickled, sent to another process and restored.
#[pyclass(frozen, module = "catenary")]
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) scene_hash: u64,
    pub(crate) particles: Vec<ParticleState>,
    pub(crate) keyframe: Vec<u8>,
    hash: u64,
}

impl State {
    /// Checks that the bytes of the keyframe are those of a keyframe.
    pub(crate) fn from_parts(
        scene_hash: u64,
        particles: Vec<ParticleState>,
        keyframe: Vec<u8>,
    ) -> PyResult<Self> {
        let decoded = Keyframe::decode(&keyframe);
        let decoded = decoded.map_err(|error| StateError::new_err(error.to_string()))?;
        let hash = recording::state_hash(&particles, decoded.torn());
        Ok(Self { scene_hash, particles, keyframe, hash })
    }

    pub(crate) fn given(&self) -> GivenState<'_> {
        let Self { scene_hash, particles, keyframe, .. } = self;
        GivenState { scene_hash: *scene_hash, particles, keyframe: Some(keyframe) }
    }

    pub(crate) fn decoded_keyframe(&self) -> PyResult<Keyframe> {
        Keyframe::decode(&self.keyframe).map_err(|error| StateError::new_err(error.to_string()))
    }
}

#[pymethods]
impl State {
    #[new]
    fn new(scene_hash: u64, particles: &[u8], keyframe: Vec<u8>) -> PyResult<Self> {
        let size = size_of::<ParticleState>();
        if !particles.len().is_multiple_of(size) {
            let message =
                format!("the particles have {} bytes (allowed: n x {size})", particles.len());
            return Err(PyValueError::new_err(message));
        }
        let particles = particles.chunks_exact(size).map(bytemuck::pod_read_unaligned).collect();
        Self::from_parts(scene_hash, particles, keyframe)
    }

    /// Hash of the scene that the state belongs to.
    #[getter]
    fn scene_hash<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        hash(py, self.scene_hash)
    }

    /// Hash of the state, as in `Snapshot.hash`.
    #[getter]
    fn hash<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        hash(py, self.hash)
    }

    /// The hash as recordings write it: 16 hexadecimal digits.
    #[getter]
    fn hash_hex(&self) -> String {
        hash_hex(self.hash)
    }

    fn __len__(&self) -> usize {
        self.particles.len()
    }

    /// The arguments of the constructor, for `pickle` and `copy`.
    fn __getnewargs__<'py>(
        &self,
        py: Python<'py>,
    ) -> (u64, Bound<'py, PyBytes>, Bound<'py, PyBytes>) {
        let particles = bytemuck::cast_slice(&self.particles);
        (self.scene_hash, PyBytes::new(py, particles), PyBytes::new(py, &self.keyframe))
    }

    fn __repr__(&self) -> String {
        let (count, hash) = (self.particles.len(), self.hash);
        format!("<catenary.State: {count} particles, hash {hash:016x}>")
    }
}

/// Longest wait for the keyframe, which a node publishes when a reader joins.
const KEYFRAME_TIMEOUT_S: f64 = 5.0;

/// Returns the newest complete state of a node.
pub(crate) fn current_state(py: Python<'_>, endpoint: &Endpoint) -> PyResult<State> {
    let mut tap = py.detach(|| Tap::attach(endpoint)).map_err(|error| attach_error(&error))?;
    let state = wait(py, Patience::new(Some(KEYFRAME_TIMEOUT_S))?, |part| {
        if let Some(state) = tap.next_state(|_| ()) {
            return completed(&state);
        }
        tap.wait(part);
        Ok(None)
    })?;
    state.ok_or_else(|| {
        Timeout::new_err(format!(
            "{endpoint} has published no complete state: a node that a command has changed in a pause publishes one at its \
             next step, such as with node.step(1)"
        ))
    })
}

/// Returns the state, if it has a keyframe of its own.
fn completed(state: &sim_contract::State<'_>) -> PyResult<Option<State>> {
    let keyframe = state.changes.iter().rev().find_map(|change| match change {
        Change::Keyframe(header, bytes) if header.step == state.header.step => Some(bytes.clone()),
        _ => None,
    });
    let scene_hash = state.load.header.scene_hash;
    keyframe.map(|bytes| State::from_parts(scene_hash, state.particles.to_vec(), bytes)).transpose()
}
