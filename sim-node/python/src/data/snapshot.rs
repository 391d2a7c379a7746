//! A state of the particles, as NumPy arrays that view it without a copy.

use std::sync::Arc;

use bytemuck::cast_slice;
use numpy::ndarray::{ArrayView1, ArrayView2, Dimension, s};
use numpy::npyffi::NPY_ARRAY_WRITEABLE;
use numpy::{PyArray, PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use recording::ForcesRow;
use sim_contract::{ParticleState, SnapshotFlags, SnapshotHeader};

use crate::convert::{hash, hash_hex};
use crate::data::forces::Forces;
use crate::error::Error;
use crate::process::OfProcess;

/// The place of the particles. It never changes.
#[derive(Debug)]
enum Memory {
    /// In shared memory, lent by a node.
    Shared(OfProcess<sim_contract::Snapshot>),
    /// In the memory of this process.
    Own(Arc<Vec<ParticleState>>),
}

/// Steps per second.
type Rate = u32;

/// Reads the forces of a step.
type ReadForces = Arc<dyn Fn(Python<'_>, u64) -> PyResult<Forces> + Send + Sync>;

/// Where the forces of the step come from.
#[derive(Clone)]
pub(crate) enum ForcesSource {
    /// Nobody asked for them. The text names the way.
    Unread(&'static str),
    /// `None` if they were not computed in this step.
    Read(Option<(ForcesRow, Rate)>),
    /// The recording is read once they are needed.
    Recorded(ReadForces),
}

/// The first field of each vector and the numbers of [`ParticleState`], in units of 4 bytes.
pub(crate) const POSITION: usize = 0;
const INVERSE_MASS: usize = 3;
pub(crate) const VELOCITY: usize = 4;
const FLAGS: usize = 7;

/// The particles after a step.
///
/// The arrays view the particles without a copy, and are read-only. Each of them keeps the snapshot alive. A
/// node lends a program at most 4 snapshots at a time, so keep copies: `snapshot.positions.copy()`.
#[pyclass(frozen, module = "catenary")]
pub(crate) struct Snapshot {
    header: SnapshotHeader,
    memory: Memory,
    forces: ForcesSource,
}

impl Snapshot {
    pub(crate) fn shared(snapshot: sim_contract::Snapshot, forces: ForcesSource) -> Self {
        let header = *snapshot.header();
        Self { header, memory: Memory::Shared(OfProcess::new("snapshot", snapshot)), forces }
    }

    pub(crate) fn own(
        header: SnapshotHeader,
        particles: Arc<Vec<ParticleState>>,
        forces: ForcesSource,
    ) -> Self {
        Self { header, memory: Memory::Own(particles), forces }
    }

    pub(crate) fn header(&self) -> &SnapshotHeader {
        &self.header
    }

    /// Calls a function with the particles.
    ///
    /// # Errors
    /// They are those of a node, and this process was forked from the one that received them.
    pub(crate) fn with_particles<R>(
        &self,
        call: impl FnOnce(&[ParticleState]) -> R,
    ) -> PyResult<R> {
        match &self.memory {
            Memory::Shared(snapshot) => snapshot.with(|snapshot| Ok(call(snapshot.particles()))),
            Memory::Own(particles) => Ok(call(particles)),
        }
    }

    /// Returns the forces of the step; `None` if they were not computed, or not read.
    pub(crate) fn forces_read(&self, py: Python<'_>) -> PyResult<Option<Forces>> {
        if matches!(self.forces, ForcesSource::Unread(_)) { Ok(None) } else { self.forces(py) }
    }

    pub(crate) fn to_vec(&self) -> PyResult<Vec<ParticleState>> {
        self.with_particles(<[_]>::to_vec)
    }
}

#[pymethods]
impl Snapshot {
    /// Positions in metres, relative to the origin of the scene. Shape: (particles, 3).
    #[getter]
    fn positions<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        vectors(this, POSITION)
    }

    /// Velocities in metres per second. Shape: (particles, 3).
    #[getter]
    fn velocities<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        vectors(this, VELOCITY)
    }

    /// Inverse masses in 1/kg; 0 for particles that the step does not move. Shape: (particles,).
    #[getter]
    fn inverse_masses<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        numbers(this, INVERSE_MASS)
    }

    /// Sums of PINNED, GRABBED, ANCHORED and FROZEN. Shape: (particles,).
    #[getter]
    fn flags<'py>(this: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        numbers(this, FLAGS)
    }

    /// Forces of the step on colliders, anchors and fixed particles. None if the node did not compute them in this step:
    /// before its first step, and in steps before the connection that reads them.
    ///
    /// Raises `Error` without `forces=True` in `attach` or `Simulation`, and `RecordingError` if the recording has none
    /// of this step.
    #[getter]
    fn forces(&self, py: Python<'_>) -> PyResult<Option<Forces>> {
        match &self.forces {
            ForcesSource::Unread(cure) => {
                Err(Error::new_err(format!("this snapshot was read without its forces: {cure}")))
            }
            ForcesSource::Read(row) => {
                row.as_ref().map(|(row, rate)| Forces::new(py, row, *rate)).transpose()
            }
            ForcesSource::Recorded(read) => read(py, self.header.step).map(Some),
        }
    }

    /// Number of the step in its run.
    #[getter]
    fn step(&self) -> u64 {
        self.header.step
    }

    /// Number of steps since the scene was loaded, reset or restored.
    #[getter]
    fn scene_step(&self) -> u64 {
        self.header.scene_step
    }

    /// Simulated time since step 0, in seconds.
    #[getter]
    fn time(&self) -> f64 {
        self.header.sim_time_ns as f64 * 1e-9
    }

    /// Hash of the state: equal states have equal hashes on every machine.
    #[getter]
    fn hash<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        hash(py, self.header.state_hash)
    }

    /// The hash as recordings write it: 16 hexadecimal digits.
    #[getter]
    fn hash_hex(&self) -> String {
        hash_hex(self.header.state_hash)
    }

    /// Number of the run. Steps begin at 0 in each run.
    #[getter]
    fn run_id(&self) -> u64 {
        self.header.run_id
    }

    /// Number of snapshots that the run has published before. A gap shows missed ones.
    #[getter]
    fn snapshot_index(&self) -> u32 {
        self.header.snapshot_index
    }

    /// Number of the load in this run.
    #[getter]
    fn topology_revision(&self) -> u32 {
        self.header.topology_revision
    }

    /// Number of torn constraints.
    #[getter]
    fn torn_count(&self) -> u32 {
        self.header.torn_count
    }

    /// Number of outcomes that are part of this state.
    #[getter]
    fn outcome_count(&self) -> u64 {
        self.header.outcome_count
    }

    /// True if the node was paused when it made this step.
    #[getter]
    fn is_paused(&self) -> bool {
        self.header.flags & SnapshotFlags::PAUSED != 0
    }

    /// True if `recorder play` publishes it.
    #[getter]
    fn is_replay(&self) -> bool {
        self.header.flags & SnapshotFlags::REPLAY != 0
    }

    /// Time of publication in seconds, on the clock of `time.monotonic`.
    #[getter]
    fn published_at(&self) -> f64 {
        self.header.publish_monotonic_ns as f64 * 1e-9
    }

    /// Time that the solver took for this step, in seconds.
    #[getter]
    fn solve_time(&self) -> f64 {
        self.header.solve_ns as f64 * 1e-9
    }

    /// Delay of the start of the step after its deadline, in seconds.
    #[getter]
    fn wake_lateness(&self) -> f64 {
        self.header.wake_late_ns as f64 * 1e-9
    }

    /// Returns the particles as they are published and recorded: 32 bytes each, little-endian.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.with_particles(|particles| PyBytes::new(py, cast_slice(particles)))
    }

    /// Returns the snapshot in the memory of this process, so that it can be kept.
    fn copy(&self) -> PyResult<Self> {
        Ok(Self::own(self.header, Arc::new(self.to_vec()?), self.forces.clone()))
    }

    fn __len__(&self) -> usize {
        self.header.particle_count as usize
    }

    fn __repr__(&self) -> String {
        let SnapshotHeader { step, particle_count, state_hash, .. } = self.header;
        format!(
            "<catenary.Snapshot of step {step}: {particle_count} particles, hash {state_hash:016x}>"
        )
    }
}

/// Number of 4-byte fields of a particle.
const FIELDS: usize = size_of::<ParticleState>() / 4;

/// Returns the particles of a snapshot, which the caller must not use after the owner is dropped.
fn particles<'py>(owner: &Bound<'py, Snapshot>) -> PyResult<&'py [ParticleState]> {
    let particles: *const [ParticleState] = owner.get().with_particles(std::ptr::from_ref)?;
    // SAFETY: the owner holds the particles, in one place and unchanged, until it is dropped. No lock is
    // held while NumPy runs code of Python.
    Ok(unsafe { &*particles })
}

/// Returns the first of three fields of each particle as a read-only array of the shape (particles, 3).
pub(crate) fn vectors<'py>(
    owner: &Bound<'py, Snapshot>,
    field: usize,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let particles = particles(owner)?;
    let fields = ArrayView2::from_shape((particles.len(), FIELDS), cast_slice(particles))
        .unwrap_or_else(|_| unreachable!("a particle has {FIELDS} fields"));
    let vectors = fields.slice(s![.., field..field + 3]);
    // SAFETY: the array holds the owner, which holds the particles.
    let array = unsafe { PyArray2::borrow_from_array(&vectors, owner.clone().into_any()) };
    Ok(read_only(array))
}

/// Returns a field of each particle as a read-only array of the shape (particles,).
fn numbers<'py, T: numpy::Element + bytemuck::AnyBitPattern>(
    owner: &Bound<'py, Snapshot>,
    field: usize,
) -> PyResult<Bound<'py, PyArray1<T>>> {
    let fields: ArrayView1<'_, T> = ArrayView1::from(cast_slice(particles(owner)?));
    // A scene may have no particle.
    let field = field.min(fields.len());
    let numbers = fields.slice(s![field..;FIELDS]);
    // SAFETY: the array holds the owner, which holds the particles.
    let array = unsafe { PyArray1::borrow_from_array(&numbers, owner.clone().into_any()) };
    Ok(read_only(array))
}

/// Forbids writing. NumPy does not let a program undo this, because the array does not own its memory. A write
/// would end the process: the memory is mapped for reading only.
fn read_only<T: numpy::Element, D: Dimension>(
    array: Bound<'_, PyArray<T, D>>,
) -> Bound<'_, PyArray<T, D>> {
    // SAFETY: the array was made just now, so nothing else uses it.
    let array_object = unsafe { &mut *array.as_array_ptr() };
    array_object.fields.flags &= !NPY_ARRAY_WRITEABLE;
    array
}
