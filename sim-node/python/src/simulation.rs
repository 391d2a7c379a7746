//! The solver in this process, without a node or shared memory.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use recorder::simulation::{colliders_row, forces_row};
use recorder::{RunDescription, bend_state, constraint_state};
use sim_contract::clock::monotonic_ns;
use sim_contract::{LoadHeader, ParticleState, SnapshotHeader, Triangle, scene_hash};
use sim_solver::{Applied, Control, Reason, SOLVER_VERSION, Scene, Solver};

use crate::arguments;
use crate::convert::{from_json, motion};
use crate::data::action::Action;
use crate::data::forces::Forces;
use crate::data::outcome::{cause, indices, rejected};
use crate::data::scene::{Bends, Topology, corners, load_scene, scene_error};
use crate::data::snapshot::{ForcesSource, POSITION, Snapshot, VELOCITY};
use crate::data::state::State;
use crate::data::view;
use crate::error::{Error, StateError};
use crate::patience::PART;
use crate::process::OfProcess;

/// The client id of every action.
const CLIENT_ID: u64 = 1;

const WITH_FORCES: &str = "make the simulation with `Simulation(..., forces=True)`";

#[pyclass(frozen, subclass, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Simulation {
    scene: Scene,
    scene_hash: u64,
    running: SharedRunning,
}

/// The running state. Worker threads do not survive a fork, so a state with several threads belongs to its
/// process.
#[derive(Debug)]
enum SharedRunning {
    OneThread(Mutex<Running>),
    Threads(OfProcess<Running>),
}

impl SharedRunning {
    fn with<R>(&self, call: impl FnOnce(&mut Running) -> PyResult<R>) -> PyResult<R> {
        match self {
            Self::OneThread(running) => {
                call(&mut running.lock().unwrap_or_else(PoisonError::into_inner))
            }
            Self::Threads(running) => running.with(call),
        }
    }
}

#[derive(Debug)]
struct Running {
    solver: Solver,
    step: u64,
    /// Commands have changed what the next step will do.
    is_changed: bool,
}

impl Running {
    /// Makes steps for as long as a look at signals can wait. Returns the number of steps that are left.
    fn advance(&mut self, count: u64) -> u64 {
        let start_ns = monotonic_ns();
        let mut left = count;
        while left > 0 {
            self.solver.step();
            self.step += 1;
            self.is_changed = false;
            left -= 1;
            if left > 0 && u128::from(monotonic_ns() - start_ns) > PART.as_nanos() {
                break;
            }
        }
        left
    }
}

impl Simulation {
    /// Calls a function with the running state, while other threads of the interpreter run.
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        call: impl FnOnce(&mut Running) -> PyResult<R> + Send,
    ) -> PyResult<R> {
        py.detach(|| self.running.with(call))
    }

    fn with_threads(scene: Scene, threads: usize, forces: bool) -> PyResult<Self> {
        let mut solver = Solver::new(&scene);
        solver.compute_forces(forces);
        solver.set_threads(threads);
        let scene_hash = scene_hash(scene.to_toml().as_bytes());
        let running = Running { solver, step: 0, is_changed: false };
        let running = match running.solver.threads() {
            1 => SharedRunning::OneThread(Mutex::new(running)),
            _ => SharedRunning::Threads(OfProcess::new("simulation with several threads", running)),
        };
        Ok(Self { scene, scene_hash, running })
    }

    /// Returns the number of elements of which a rejected command has named an unknown one.
    fn count(&self, py: Python<'_>, reason: Reason) -> PyResult<Option<usize>> {
        Ok(Some(match reason {
            Reason::UnknownParticle => self.__len__(py)?,
            Reason::UnknownConstraint => {
                self.with(py, |running| Ok(running.solver.constraints().count()))?
            }
            Reason::UnknownAnchor => self.scene.anchors.len(),
            Reason::UnknownCollider => self.scene.colliders.len(),
            _ => return Ok(None),
        }))
    }
}

#[pymethods]
impl Simulation {
    #[new]
    #[pyo3(signature = (scene=None, threads=1, *, toml=None, forces=false))]
    fn new(
        py: Python<'_>,
        scene: Option<PathBuf>,
        #[pyo3(from_py_with = arguments::threads)] threads: usize,
        toml: Option<&str>,
        forces: bool,
    ) -> PyResult<Self> {
        py.detach(|| {
            let scene = match (scene, toml) {
                (Some(scene), None) => load_scene(&scene.to_string_lossy())?,
                (None, Some(toml)) => {
                    Scene::from_toml(toml, "scene").map_err(|error| scene_error(&error))?
                }
                _ => return Err(PyTypeError::new_err("give either a scene or `toml`")),
            };
            Self::with_threads(scene, threads, forces)
        })
    }

    /// Makes `count` steps. Other threads of the interpreter run meanwhile; Ctrl-C ends it between steps.
    #[pyo3(signature = (count=1))]
    fn step(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::count)] count: u64,
    ) -> PyResult<()> {
        let mut left = count;
        loop {
            left = self.with(py, |running| Ok(running.advance(left)))?;
            if left == 0 {
                return Ok(());
            }
            py.check_signals()?;
        }
    }

    /// Applies an action before the next step. Raises `Rejected` if it is wrong.
    ///
    /// Actions that concern a node (`pause`, `resume`, `step`, `mark`, a time scale) change nothing here;
    /// `load`, `rewind` and `restore` are rejected.
    fn apply(&self, py: Python<'_>, action: &Action) -> PyResult<()> {
        let action = action.0;
        let result = self.with(py, |running| {
            running.is_changed = true;
            Ok(running.solver.apply(CLIENT_ID, &action))
        })?;
        let reason = match result {
            Ok(Applied::Control(
                Control::Load { .. } | Control::Rewind { .. } | Control::Restore,
            )) => Reason::NoEffectHere,
            Ok(_) => return Ok(()),
            Err(reason) => reason,
        };
        let count = self.count(py, reason)?;
        let allowed = count.map(indices).or_else(|| action.allowed_values(reason));
        let message = format!("rejected: {}", cause(Some(reason), allowed.as_deref(), &action));
        Err(rejected(py, message, Some(reason), None))
    }

    /// Returns a copy of the current state.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        self.with(py, |running| {
            let particles = bytemuck::cast_slice(running.solver.particles()).to_vec();
            let forces = match forces_row(&running.solver, running.step) {
                Some(row) => ForcesSource::Read(Some((row, self.rate()))),
                None => ForcesSource::Unread(WITH_FORCES),
            };
            Ok(Snapshot::own(self.header(running), particles, forces))
        })
    }

    /// Copy of the current positions in metres. Shape: (particles, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        view::vectors(&Bound::new(py, self.snapshot(py)?)?, POSITION)
    }

    /// Copy of the current velocities in metres per second. Shape: (particles, 3).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        view::vectors(&Bound::new(py, self.snapshot(py)?)?, VELOCITY)
    }

    /// Hash of the current state.
    #[getter]
    fn hash(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |running| Ok(running.solver.state_hash()))
    }

    /// Number of steps so far.
    #[getter]
    fn step_count(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |running| Ok(running.step))
    }

    /// Simulated time of these steps, in seconds.
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.step_count(py)? as f64 / f64::from(self.rate()))
    }

    /// Steps per second.
    #[getter]
    fn rate(&self) -> u32 {
        self.scene.solver.rate_hz
    }

    /// Returns the scene as TOML, with every default written out.
    fn scene(&self) -> String {
        self.scene.to_toml()
    }

    /// Returns the constraints.
    fn topology(&self, py: Python<'_>) -> PyResult<Topology> {
        let constraints = self.with(py, |running| {
            Ok(running.solver.constraints().map(constraint_state).collect::<Vec<_>>())
        })?;
        Topology::new(py, &self.load_header(), &constraints)
    }

    /// Returns the bends.
    fn bends(&self, py: Python<'_>) -> PyResult<Bends> {
        let bends = self
            .with(py, |running| Ok(running.solver.bends().map(bend_state).collect::<Vec<_>>()))?;
        Bends::new(py, &bends)
    }

    /// Returns the particles of each triangle of the surface. Shape: (triangles, 3).
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let triangles = self.with(py, |running| {
            let triangles = running.solver.triangles().iter();
            Ok(triangles.map(|corners| Triangle { corners: *corners }).collect::<Vec<_>>())
        })?;
        corners(py, &triangles)
    }

    /// Returns the current parameters by name. None is off.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let values = self.with(py, |running| Ok(running.solver.parameter_values()))?;
        from_json(py, &values)
    }

    /// Returns the indices of the torn constraints, in the order of tearing.
    fn torn<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let torn = self.with(py, |running| Ok(running.solver.torn().to_vec()))?;
        Ok(PyArray1::from_vec(py, torn))
    }

    /// Returns the colliders in their current poses.
    fn colliders<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let row = self.with(py, |running| Ok(colliders_row(&running.solver, running.step)))?;
        from_json(py, &row.colliders)
    }

    /// Returns the forces of the last step on colliders, anchors and fixed particles: all 0 before the first step, and
    /// in a step that put a state in place.
    ///
    /// Raises `Error` for a simulation that was made without `forces=True`.
    fn forces(&self, py: Python<'_>) -> PyResult<Forces> {
        let row = self.with(py, |running| {
            forces_row(&running.solver, running.step).ok_or_else(|| {
                Error::new_err(format!("this simulation computes no forces: {WITH_FORCES}"))
            })
        })?;
        Forces::new(py, &row, self.rate())
    }

    /// Returns the complete state, which `restore` puts in place again.
    ///
    /// Raises `StateError` between a command and the step that shows it.
    fn state(&self, py: Python<'_>) -> PyResult<State> {
        self.with(py, |running| {
            if running.is_changed {
                return Err(StateError::new_err(
                    "commands wait for the next step: call `step()` before `state()`",
                ));
            }
            let keyframe = running.solver.keyframe().encode();
            let particles = bytemuck::cast_slice(running.solver.particles()).to_vec();
            State::from_parts(self.scene_hash, particles, keyframe)
        })
    }

    /// Puts a state of the same scene in place at once. `step_count` continues.
    ///
    /// A `State` replaces everything, a `Snapshot` only positions and velocities. Raises `StateError` if it
    /// belongs to another scene.
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        if let Ok(state) = state.cast::<State>() {
            self.restore_state(py, state.get())
        } else if let Ok(snapshot) = state.cast::<Snapshot>() {
            self.restore_motion(py, &snapshot.get().to_vec()?)
        } else {
            Err(PyTypeError::new_err("expected a State or a Snapshot"))
        }
    }

    /// Replaces the positions and velocities of all particles at once. Shape of both: (particles, 3).
    fn set_motion(
        &self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        velocities: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        self.restore_motion(py, &motion(positions, velocities)?)
    }

    /// Puts the initial state and parameters in place at once. `step_count` continues.
    ///
    /// A node spends a step on it, which shows the initial state.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |running| {
            let mut solver = Solver::new(&self.scene);
            solver.set_threads(running.solver.threads());
            solver.compute_forces(running.solver.forces().is_some());
            (running.solver, running.is_changed) = (solver, false);
            Ok(())
        })
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |running| Ok(running.solver.particle_count()))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (name, count, step) = (&self.scene.name, self.__len__(py)?, self.step_count(py)?);
        Ok(format!("<catenary.Simulation of '{name}': {count} particles, step {step}>"))
    }
}

impl Simulation {
    fn restore_state(&self, py: Python<'_>, state: &State) -> PyResult<()> {
        if state.scene_hash != self.scene_hash {
            return Err(StateError::new_err(format!(
                "the state belongs to a scene with the hash {:016x}, but this one has {:016x}",
                state.scene_hash, self.scene_hash
            )));
        }
        let keyframe = state.decoded_keyframe()?;
        self.with(py, |running| {
            let particles = bytemuck::cast_slice(&state.particles);
            let restored = running.solver.restore(particles, &keyframe);
            restored.map_err(|error| StateError::new_err(error.to_string()))?;
            running.is_changed = false;
            Ok(())
        })
    }

    fn restore_motion(&self, py: Python<'_>, particles: &[ParticleState]) -> PyResult<()> {
        self.with(py, |running| {
            let restored = running.solver.put_motion_in_place(bytemuck::cast_slice(particles));
            restored.map_err(|error| StateError::new_err(error.to_string()))?;
            // It integrates nothing, and completes the state.
            running.solver.step();
            running.is_changed = false;
            Ok(())
        })
    }

    fn header(&self, running: &Running) -> SnapshotHeader {
        let Running { solver, step, .. } = running;
        SnapshotHeader {
            contract_version: sim_contract::CONTRACT_VERSION,
            solver_version: SOLVER_VERSION,
            step: *step,
            scene_step: solver.scene_step(),
            sim_time_ns: RunDescription::duration_ns(*step, self.rate()),
            state_hash: solver.state_hash(),
            torn_count: u32::try_from(solver.torn().len()).unwrap_or(u32::MAX),
            particle_count: u32::try_from(solver.particle_count()).unwrap_or(u32::MAX),
            stride: 1,
            ..SnapshotHeader::default()
        }
    }

    fn load_header(&self) -> LoadHeader {
        LoadHeader {
            scene_hash: self.scene_hash,
            origin: self.scene.origin,
            rate_hz: self.scene.solver.rate_hz,
            method: self.scene.solver.method as u32,
            ..LoadHeader::default()
        }
    }
}
