//! The solver in this process, without a node or shared memory.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::{PyMemoryError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use recording::simulation::{SteppedRecording, apply, colliders_row, forces_row, recording_bytes};
use recording::{Existing, RunDescription, SceneState, bend_state, constraint_state};
use sim_contract::{
    LoadHeader, ParticleState, RestoreContents, SnapshotHeader, Triangle, scene_hash,
};
use sim_host::clock::monotonic_ns;
use sim_solver::{Applied, EnergyMeter, Reason, RestoreError, SOLVER_VERSION, Scene, Solver};

use crate::arguments;
use crate::convert::{from_json, hash, hash_hex, motion};
use crate::data::action::Action;
use crate::data::forces::Forces;
use crate::data::outcome::{cause, indices, rejected};
use crate::data::scene::{Bends, Topology, corners, load_scene, scene_error};
use crate::data::snapshot::{ForcesSource, POSITION, Snapshot, VELOCITY, vectors};
use crate::data::state::State;
use crate::error::{Error, StateError, recording_error};
use crate::patience::PART;
use crate::picture::{Caption, Corners, PictureRequest, PixelSize};
use crate::process::{OfProcess, whole};

/// The client id of every action: that of a command in a file without one.
const CLIENT_ID: u64 = 0;

const WITH_FORCES: &str = "make the simulation with `Simulation(..., forces=True)`";

#[pyclass(frozen, subclass, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Simulation {
    scene: Scene,
    scene_hash: u64,
    threads: usize,
    has_forces: bool,
    /// In a box, because it contains values of an alignment that the allocator of Python objects does not have.
    running: Box<SharedRunning>,
}

/// The running state. Worker threads do not survive a fork, and two processes must not write the same file, so a
/// state with one of them belongs to its process.
#[derive(Debug)]
enum SharedRunning {
    Alone(Mutex<Running>),
    OfProcess(OfProcess<Running>),
}

impl SharedRunning {
    fn with<R>(&self, call: impl FnOnce(&mut Running) -> PyResult<R>) -> PyResult<R> {
        let call = |running: &mut Running| {
            running.is_in_call = true;
            let result = call(running);
            running.is_in_call = false;
            result
        };
        match self {
            Self::Alone(running) => {
                let mut running = whole(running, "simulation")?;
                call(&mut running)
            }
            Self::OfProcess(running) => running.with(call),
        }
    }
}

#[derive(Debug)]
struct Running {
    solver: Solver,
    step: u64,
    /// Commands have changed what the next step will do.
    is_changed: bool,
    /// Copy of the particles, once a program has asked for them after the last change.
    particles: Option<Arc<Vec<ParticleState>>>,
    recording: Option<Recorded>,
    /// Measures the energy, once a program has asked for it.
    meter: Option<EnergyMeter>,
    /// A call is under way, or a panic has ended it.
    is_in_call: bool,
}

/// The recording of the steps, and its path for errors.
#[derive(Debug)]
struct Recorded {
    path: PathBuf,
    file: SteppedRecording,
}

impl Running {
    /// Makes steps for as long as a look at signals can wait. Returns the number of steps that are left.
    fn advance(&mut self, count: u64) -> PyResult<u64> {
        let start_ns = monotonic_ns();
        let mut left = count;
        while left > 0 {
            self.make_step()?;
            left -= 1;
            if left > 0 && u128::from(monotonic_ns() - start_ns) > PART.as_nanos() {
                break;
            }
        }
        Ok(left)
    }

    /// Makes a step and records it. After an error of writing, the simulation goes on unrecorded.
    fn make_step(&mut self) -> PyResult<()> {
        self.solver.step();
        self.step += 1;
        (self.is_changed, self.particles) = (false, None);
        let Some(recording) = &mut self.recording else { return Ok(()) };
        let Err(error) = recording.file.write_step(&self.solver, self.step) else { return Ok(()) };
        let error = recording_error(&recording.path, &error);
        self.recording = None;
        Err(error)
    }

    /// Applies an action before the next step, and records its outcome.
    fn apply(&mut self, action: sim_contract::Action) -> Result<(), Reason> {
        let result = apply(&mut self.solver, CLIENT_ID, &action);
        self.note(action, result);
        result.map(|_| ())
    }

    /// Records the outcome of a command, which changes the next step unless it was rejected.
    fn note(&mut self, action: sim_contract::Action, result: Result<Applied, Reason>) {
        if result.is_ok() {
            (self.is_changed, self.particles) = (true, None);
        }
        if let Some(recording) = &mut self.recording {
            recording.file.add_command(self.step + 1, action, result);
        }
    }

    /// Puts a state in place, and makes the step that shows it.
    fn put_in_place(
        &mut self,
        contents: RestoreContents,
        put: impl FnOnce(&mut Solver) -> Result<(), RestoreError>,
    ) -> PyResult<()> {
        put(&mut self.solver).map_err(|error| StateError::new_err(error.to_string()))?;
        let state_hash = self.solver.hash_in_place();
        self.note(sim_contract::Action::Restore { contents, state_hash }, Ok(Applied::InPlace));
        self.make_step()
    }

    /// Returns the particles as they are after the last step.
    fn particles(&mut self) -> Arc<Vec<ParticleState>> {
        let solver = &self.solver;
        let copy = || Arc::new(bytemuck::cast_slice(solver.particles()).to_vec());
        Arc::clone(self.particles.get_or_insert_with(copy))
    }

    /// Completes the recording, if there is one.
    fn finish(&mut self) -> PyResult<()> {
        let Some(Recorded { path, file }) = self.recording.take() else { return Ok(()) };
        file.finish().map(|_| ()).map_err(|error| recording_error(&path, &error))
    }
}

impl Drop for Running {
    /// Completes the recording of a program that does not close it. After a panic, its last step may be missing, so
    /// the file keeps its `.part`.
    fn drop(&mut self) {
        if !self.is_in_call {
            // There is nobody to tell; `close` does.
            _ = self.finish();
        }
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

    fn begin(
        scene: Scene,
        threads: usize,
        has_forces: bool,
        record: Option<(&Path, Existing)>,
    ) -> PyResult<Self> {
        let beside_bytes = record.map_or(0, |_| recording_bytes(&scene));
        scene
            .check_memory(beside_bytes)
            .map_err(|error| PyMemoryError::new_err(error.to_string()))?;
        let mut solver = Solver::new(&scene);
        solver.compute_forces(has_forces);
        solver.set_threads(threads);
        let recording = record.map(|(path, existing)| {
            let file = SteppedRecording::begin(path, existing, &scene, &solver);
            let file = file.map_err(|error| recording_error(path, &error))?;
            Ok::<_, PyErr>(Recorded { path: path.to_owned(), file })
        });
        let recording = recording.transpose()?;
        let scene_hash = scene_hash(scene.to_toml().as_bytes());
        let running = Running {
            solver,
            step: 0,
            is_changed: false,
            particles: None,
            recording,
            meter: None,
            is_in_call: false,
        };
        let running = match (&running.recording, running.solver.threads()) {
            (None, 1) => SharedRunning::Alone(Mutex::new(running)),
            (None, _) => {
                SharedRunning::OfProcess(OfProcess::new("simulation with several threads", running))
            }
            (Some(_), _) => {
                SharedRunning::OfProcess(OfProcess::new("recorded simulation", running))
            }
        };
        Ok(Self { scene, scene_hash, threads, has_forces, running: Box::new(running) })
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
    #[pyo3(signature = (scene=None, threads=1, *, toml=None, forces=false, record=None, overwrite=false))]
    #[allow(clippy::too_many_arguments, reason = "these are the keywords of Python")]
    fn new(
        py: Python<'_>,
        scene: Option<PathBuf>,
        #[pyo3(from_py_with = arguments::threads)] threads: usize,
        toml: Option<&str>,
        forces: bool,
        record: Option<PathBuf>,
        overwrite: bool,
    ) -> PyResult<Self> {
        let existing = if overwrite { Existing::Overwrite } else { Existing::Refuse };
        py.detach(|| {
            let scene = match (scene, toml) {
                (Some(scene), None) => load_scene(&scene.to_string_lossy())?,
                (None, Some(toml)) => {
                    Scene::from_toml(toml, "scene").map_err(|error| scene_error(&error))?
                }
                _ => return Err(PyTypeError::new_err("give either a scene or `toml`")),
            };
            Self::begin(scene, threads, forces, record.as_deref().map(|path| (path, existing)))
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
            left = self.with(py, |running| running.advance(left))?;
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
        let result = self.with(py, |running| Ok(running.apply(action)))?;
        let Err(reason) = result else { return Ok(()) };
        let count = self.count(py, reason)?;
        let allowed = count.map(indices).or_else(|| action.allowed_values(reason));
        let message = format!("rejected: {}", cause(Some(reason), allowed.as_deref(), &action));
        Err(rejected(py, message, Some(reason), None))
    }

    /// Returns the current state. It keeps its values when the simulation goes on.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        self.with(py, |running| {
            let particles = running.particles();
            let forces = match forces_row(&running.solver, running.step) {
                Some(row) => ForcesSource::Read(Some((row, self.rate()))),
                None => ForcesSource::Unread(WITH_FORCES),
            };
            Ok(Snapshot::own(self.header(running), particles, forces))
        })
    }

    /// The current positions in metres, as a read-only view of `snapshot()`. Shape: (particles, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        vectors(&Bound::new(py, self.snapshot(py)?)?, POSITION)
    }

    /// The current velocities in metres per second, as a read-only view of `snapshot()`. Shape: (particles, 3).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        vectors(&Bound::new(py, self.snapshot(py)?)?, VELOCITY)
    }

    /// Hash of the current state.
    #[getter]
    fn hash<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        hash(py, self.with(py, |running| Ok(running.solver.state_hash()))?)
    }

    /// The hash as recordings write it: 16 hexadecimal digits.
    #[getter]
    fn hash_hex(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |running| Ok(hash_hex(running.solver.state_hash())))
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
        let values = self.with(py, |running| Ok(running.solver.parameter_values().clone()))?;
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

    /// Returns the energy of the current state by kind: `kinetic`, `potential` (-m g.x, with x from the origin of the scene)
    /// and `elastic`, in J if the scene is in metres, of the free particles and of the constraints and bends that are not torn.
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let energy = self.with(py, |running| {
            let solver = &running.solver;
            let meter = running.meter.get_or_insert_with(|| EnergyMeter::of(solver));
            Ok(meter.measure_solver(solver))
        })?;
        from_json(py, &energy)
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

    /// Puts a state of the same scene in place, and makes the step that shows it. `step_count` continues.
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

    /// Replaces the positions and velocities of all particles, and makes the step that shows them. Shape of both:
    /// (particles, 3).
    fn set_motion(
        &self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        velocities: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        self.restore_motion(py, &motion(positions, velocities)?)
    }

    /// Puts the initial state and parameters in place, and makes the step that shows them. `step_count` continues.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |running| {
            // A reset is never rejected.
            _ = running.apply(sim_contract::Action::Reset);
            running.make_step()
        })
    }

    /// Returns a picture of the current state as `recorder export --png` draws it, from the top to the bottom: red,
    /// green and blue. Shape: (height, width, 3).
    ///
    /// `size` is width and height in pixels. `view` is "front", "side", "top" or "iso"; by default it suits the scene.
    /// The style "wires" shows particles, constraints and triangles, and "shaded" surfaces, each triangle in one shade. `bounds` are two
    /// corners of the box that the picture shows, by default around the state: give them to keep the camera still.
    #[pyo3(signature = (*, size=(960, 720), view=None, style="wires", bounds=None))]
    #[allow(clippy::too_many_arguments, reason = "these are the keywords of Python")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        size: PixelSize,
        view: Option<&str>,
        style: &str,
        bounds: Option<Corners>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let request = PictureRequest::new(size, view, style, bounds)?;
        let (scene, rate) = (&self.scene, f64::from(self.rate()));
        let (state, time_s) = self.with(py, |running| {
            let state = SceneState::of_solver(&running.solver, scene, running.step);
            Ok((state, running.step as f64 / rate))
        })?;
        let caption = Caption { scene_name: scene.name.clone(), up: scene.up, time_s };
        request.draw(py, &state, Some(scene), caption)
    }

    /// Completes the recording, if there is one. The simulation can go on, unrecorded.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, Running::finish)
    }

    /// The arguments of the constructor, for `pickle` and `copy`: a copy is not recorded.
    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let arguments = PyDict::new(py);
        arguments.set_item("toml", self.scene.to_toml())?;
        arguments.set_item("threads", self.threads)?;
        arguments.set_item("forces", self.has_forces)?;
        Ok((PyTuple::empty(py), arguments))
    }

    /// Puts the state of a pickled or copied simulation in place.
    fn _continue_from(&self, py: Python<'_>, state: &State, step_count: u64) -> PyResult<()> {
        let keyframe = state.decoded_keyframe()?;
        self.with(py, |running| {
            let restored =
                running.solver.restore(bytemuck::cast_slice(&state.particles), &keyframe);
            restored.map_err(|error| StateError::new_err(error.to_string()))?;
            (running.step, running.particles) = (step_count, None);
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
        let particles = bytemuck::cast_slice(&state.particles);
        let put = |solver: &mut Solver| solver.put_in_place(particles, &keyframe);
        self.with(py, |running| running.put_in_place(RestoreContents::State, put))
    }

    fn restore_motion(&self, py: Python<'_>, particles: &[ParticleState]) -> PyResult<()> {
        let put = |solver: &mut Solver| solver.put_motion_in_place(bytemuck::cast_slice(particles));
        self.with(py, |running| running.put_in_place(RestoreContents::Motion, put))
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
