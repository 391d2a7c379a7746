//! Recordings, from which snapshots are read at any step.

use std::error::Error as StdError;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::{
    LogReader, Message, ReadError, RunDescription, SceneState, SceneStateError, StepRow, Tape,
    TapeError, complete_state,
};
use sim_solver::Scene;

use crate::arguments;
use crate::convert::from_json;
use crate::data::forces::Forces;
use crate::data::scene::{Bends, Topology, corners};
use crate::data::snapshot::{ForcesSource, Snapshot};
use crate::data::state::State;
use crate::error::{Error, RecordingError, recording_error};
use crate::patience::run_until_signal;
use crate::picture::{Caption, Corners, PictureRequest, PixelSize};

#[pyclass(frozen, subclass, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Recording {
    path: PathBuf,
    /// `None` once it is closed.
    tape: Mutex<Option<Tape>>,
    /// The scene, once it is needed. `None` if it cannot be read.
    scene: OnceLock<Option<Scene>>,
}

impl Recording {
    fn tape(&self) -> MutexGuard<'_, Option<Tape>> {
        self.tape.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls a function with the open recording.
    fn with<T>(&self, call: impl FnOnce(&mut Tape) -> PyResult<T>) -> PyResult<T> {
        let mut tape = self.tape();
        let closed = || Error::new_err(format!("{}: this recording is closed", self.path()));
        call(tape.as_mut().ok_or_else(closed)?)
    }

    fn run<T>(&self, read: impl FnOnce(&RunDescription) -> T) -> PyResult<T> {
        self.with(|tape| Ok(read(tape.run())))
    }

    fn read<T: Send, E: StdError>(
        &self,
        py: Python<'_>,
        read: impl FnOnce(&mut Tape) -> Result<T, E> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.with(|tape| read(tape).map_err(|error| self.error(&error))))
    }

    /// Returns what `pick` selects from the messages of the file.
    fn scan<T: Send>(
        &self,
        py: Python<'_>,
        pick: impl Fn(Message) -> Option<T> + Sync,
    ) -> PyResult<Vec<T>> {
        self.with(|_| Ok(()))?;
        let scanned = run_until_signal(py, |signal| {
            let mut log = LogReader::open_until(&self.path, signal)?;
            let mut picked = Vec::new();
            while let Some(logged) = log.next_message()? {
                picked.extend(pick(logged.message));
            }
            Ok(picked)
        })?;
        scanned.map_err(|error: ReadError| self.error(&error))
    }

    fn error(&self, error: &dyn StdError) -> PyErr {
        recording_error(&self.path, error)
    }

    fn require_step(&self, step: u64) -> PyResult<()> {
        let (first, last) = self.with(|tape| Ok((tape.first_step(), tape.last_step())))?;
        if (first..=last).contains(&step) {
            return Ok(());
        }
        let path = self.path();
        let message = format!("{path} has no step {step} (it has {first} to {last})");
        Err(PyKeyError::new_err(message))
    }

    /// Returns the scene of the recording, if it can be read.
    fn parsed_scene(&self, tape: &Tape) -> Option<&Scene> {
        let parse = || {
            let text = std::str::from_utf8(tape.log().scene()).ok()?;
            Scene::from_toml(text, "scene.toml").ok()
        };
        self.scene.get_or_init(parse).as_ref()
    }

    fn malformed(&self, topic: &str) -> PyErr {
        RecordingError::new_err(format!("{}: {topic} is malformed", self.path()))
    }
}

#[pymethods]
impl Recording {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        // Without an index, the whole file is scanned.
        let tape = run_until_signal(py, |stop| Tape::open(&path, Some(stop), &mut |_, _| ()))?;
        let tape = tape.map_err(|error| recording_error(&path, &error))?;
        Ok(Self { path, tape: Mutex::new(Some(tape)), scene: OnceLock::new() })
    }

    /// Path of the file.
    #[getter]
    fn path(&self) -> String {
        self.path.display().to_string()
    }

    /// First recorded step.
    #[getter]
    fn first_step(&self) -> PyResult<u64> {
        self.with(|tape| Ok(tape.first_step()))
    }

    /// Last recorded step.
    #[getter]
    fn last_step(&self) -> PyResult<u64> {
        self.with(|tape| Ok(tape.last_step()))
    }

    /// Steps per second.
    #[getter]
    fn rate(&self) -> PyResult<u32> {
        self.run(|run| run.rate_hz)
    }

    /// Name of the scene.
    #[getter]
    fn scene_name(&self) -> PyResult<String> {
        self.run(|run| run.scene_name.clone())
    }

    /// Number of particles.
    #[getter]
    fn particle_count(&self) -> PyResult<u32> {
        self.run(|run| run.particle_count)
    }

    /// Number of the recorded run.
    #[getter]
    fn run_id(&self) -> PyResult<u64> {
        self.run(|run| run.run_id)
    }

    /// Returns the scene as TOML.
    fn scene(&self) -> PyResult<String> {
        let text = self.with(|tape| Ok(String::from_utf8(tape.log().scene().to_vec())))?;
        text.map_err(|_| RecordingError::new_err(format!("{}: the scene is not text", self.path())))
    }

    /// Returns the constraints.
    fn topology(&self, py: Python<'_>) -> PyResult<Topology> {
        let (header, constraints) = self.with(|tape| {
            let topology = tape.topology();
            Ok((tape.run().load_header(topology), topology.constraints()))
        })?;
        let constraints = constraints.ok_or_else(|| self.malformed("/topology"))?;
        Topology::new(py, &header, &constraints)
    }

    /// Returns the bends.
    fn bends(&self, py: Python<'_>) -> PyResult<Bends> {
        let bends = self.with(|tape| Ok(tape.topology().bends()))?;
        Bends::new(py, &bends.ok_or_else(|| self.malformed("/topology"))?)
    }

    /// Returns the particles of each triangle of the surface. Shape: (triangles, 3).
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let triangles = self.with(|tape| Ok(tape.surface().triangles()))?;
        corners(py, &triangles.ok_or_else(|| self.malformed("/surface"))?)
    }

    /// Returns the snapshot of the last recorded step up to `step`, or else the first one.
    fn at_or_before(
        this: &Bound<'_, Self>,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<Snapshot> {
        let (header, particles) = this.get().read(py, |tape| {
            let state = tape.state_at(step)?;
            Ok::<_, TapeError>((tape.run().snapshot_header(&state.row), state.particles))
        })?;
        let recording = this.clone().unbind();
        let read_forces = move |py: Python<'_>, step| recording.get().forces(py, step);
        Ok(Snapshot::own(header, particles, ForcesSource::Recorded(Arc::new(read_forces))))
    }

    /// Returns the first recorded step after `step`.
    fn step_after(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<Option<u64>> {
        let next = self.read(py, |tape| tape.step_after(step))?;
        Ok((next > step).then_some(next))
    }

    /// Returns the last recorded step up to `step`, or else the first one.
    fn step_at(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<u64> {
        self.read(py, |tape| tape.step_at(step))
    }

    /// Returns the indices of the constraints that are torn at a step, in the order of tearing.
    fn torn<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let state = self.read(py, |tape| tape.state_at(step))?;
        Ok(PyArray1::from_iter(py, state.torn.indices()))
    }

    /// Returns the forces of a step on colliders, anchors and fixed particles.
    ///
    /// Raises `KeyError` for a step before the first or after the last one, and `RecordingError` if the file has no
    /// forces of the step: it was made without `--forces`, or no step has led to its first state.
    pub(crate) fn forces(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<Forces> {
        self.require_step(step)?;
        self.forces_if_recorded(py, step)?.ok_or_else(|| {
            RecordingError::new_err(format!(
                "{} has no forces of step {step}: `recorder record --forces` and `recorder simulate --forces` \
                 write those of each step but the first",
                self.path()
            ))
        })
    }

    /// Returns the forces of a step, or None if the file has no forces of the step.
    #[pyo3(name = "_forces")]
    fn forces_if_recorded(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<Option<Forces>> {
        let row = self.read(py, |tape| tape.forces_at(step))?;
        let rate = self.rate()?;
        row.map(|row| Forces::new(py, &row, rate)).transpose()
    }

    /// Returns a picture of a recorded step as `recorder export --png` draws it, from the top to the bottom: red,
    /// green and blue. Shape: (height, width, 3).
    ///
    /// `size` is width and height in pixels. `view` is "front", "side", "top" or "iso"; by default it suits the scene.
    /// The style "wires" shows particles, constraints and triangles, and "shaded" surfaces, each triangle in one shade. `bounds` are two
    /// corners of the box that the picture shows, by default around the state: give them to keep the camera still.
    ///
    /// Raises `KeyError` for a step that was not recorded.
    #[pyo3(signature = (step, *, size=(960, 720), view=None, style="wires", bounds=None))]
    #[allow(clippy::too_many_arguments, reason = "these are the keywords of Python")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
        size: PixelSize,
        view: Option<&str>,
        style: &str,
        bounds: Option<Corners>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let request = PictureRequest::new(size, view, style, bounds)?;
        let (state, caption) = self.read(py, |tape| {
            let scene = self.parsed_scene(tape);
            let state = SceneState::of_tape(tape, step, scene)?;
            let run = tape.run();
            let passed = state.row.step.saturating_sub(tape.first_step());
            let time_s = passed as f64 / f64::from(run.rate_hz);
            let up = scene.map_or(run.up, |scene| scene.up);
            let caption = Caption { scene_name: run.scene_name.clone(), up, time_s };
            Ok::<_, SceneStateError>((state, caption))
        })?;
        if state.row.step != step {
            self.require_step(step)?;
            return Err(PyKeyError::new_err(format!("{} has no step {step}", self.path())));
        }
        let scene = self.scene.get().and_then(Option::as_ref);
        request.draw(py, &state, scene, caption)
    }

    /// Returns a table of all recorded steps, by column: `pandas.DataFrame(recording.steps())`.
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.scan(py, |message| match message {
            Message::Step(row) => Some(row),
            _ => None,
        })?;
        let rate = f64::from(self.rate()?);
        let table = PyDict::new(py);
        let column = |field: fn(&StepRow) -> u64| PyArray1::from_iter(py, rows.iter().map(field));
        table.set_item("step", column(|row| row.step))?;
        table.set_item("scene_step", column(|row| row.scene_step))?;
        let times = rows.iter().map(|row| row.step as f64 / rate);
        table.set_item("time", PyArray1::from_iter(py, times))?;
        table.set_item("state_hash", column(|row| row.state_hash))?;
        table.set_item("torn_count", column(|row| row.torn_count.into()))?;
        table.set_item("outcome_count", column(|row| row.outcome_count))?;
        table.set_item("wake_late_ns", column(|row| row.wake_late_ns))?;
        table.set_item("solve_ns", column(|row| row.solve_ns))?;
        Ok(table)
    }

    /// Returns the outcomes of all commands, by row: `pandas.DataFrame(recording.outcomes())`.
    fn outcomes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.scan(py, |message| match message {
            Message::Outcome(row) => Some(row),
            _ => None,
        })?;
        from_json(py, &rows)
    }

    /// Returns the complete state after a step, from which a simulation continues with the same bits.
    ///
    /// It is simulated from the last complete state in the file, and compared with every snapshot on the way; a
    /// step without a snapshot is proved by the next one. Raises `KeyError` for a step before the first or after
    /// the last one, and `RecordingError` if the file does not lead to the step, as after missing outcomes.
    fn state(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::step)] step: u64,
    ) -> PyResult<State> {
        self.require_step(step)?;
        let state = run_until_signal(py, |signal| {
            self.with(|tape| {
                let state = complete_state(tape, step, u64::MAX, signal);
                state.map_err(|error| self.error(&error))
            })
        })??;
        State::from_parts(state.scene_hash, state.particles, state.keyframe)
    }

    /// Closes the file. Snapshots and arrays stay valid.
    fn close(&self) {
        self.tape().take();
    }

    fn __repr__(&self) -> String {
        let path = self.path();
        match &*self.tape() {
            Some(tape) => {
                let (first, last) = (tape.first_step(), tape.last_step());
                format!("<catenary.Recording '{path}': steps {first} to {last}>")
            }
            None => format!("<catenary.Recording '{path}': closed>"),
        }
    }
}
