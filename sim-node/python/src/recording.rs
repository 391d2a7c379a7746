//! Recordings, from which snapshots are read at any step.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recorder::{LogReader, Message, OutcomeRow, RunDescription, StepRow, Tape, TapeState};
use sim_contract::SnapshotHeader;

use crate::convert::from_json;
use crate::data::scene::{Topology, corners};
use crate::data::snapshot::Snapshot;
use crate::error::{RecordingError, log_error, tape_error};

#[pyclass(frozen, subclass, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Recording {
    path: String,
    tape: Mutex<Tape>,
}

impl Recording {
    fn tape(&self) -> MutexGuard<'_, Tape> {
        self.tape.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run<T>(&self, read: impl FnOnce(&RunDescription) -> T) -> T {
        read(self.tape().run())
    }

    fn read<T: Send>(
        &self,
        py: Python<'_>,
        read: impl FnOnce(&mut Tape) -> Result<T, recorder::TapeError> + Send,
    ) -> PyResult<T> {
        py.detach(|| read(&mut self.tape()).map_err(|error| tape_error(&self.path, &error)))
    }

    /// Calls `on_message` with every message of the file.
    fn scan(&self, mut on_message: impl FnMut(Message)) -> PyResult<()> {
        let failed = |error| log_error(&self.path, &error);
        let mut log = LogReader::open(Path::new(&self.path)).map_err(failed)?;
        while let Some(logged) = log.next_message().map_err(failed)? {
            on_message(logged.message);
        }
        Ok(())
    }
}

/// Returns the header of a recorded snapshot.
fn header(run: &RunDescription, state: &TapeState) -> SnapshotHeader {
    let row = &state.row;
    SnapshotHeader {
        contract_version: run.contract_version,
        solver_version: run.solver_version,
        run_id: run.run_id,
        step: row.step,
        scene_step: row.scene_step,
        sim_time_ns: RunDescription::duration_ns(row.step, run.rate_hz),
        state_hash: row.state_hash,
        outcome_count: row.outcome_count,
        wake_late_ns: row.wake_late_ns,
        solve_ns: row.solve_ns,
        topology_revision: row.topology_revision,
        torn_count: row.torn_count,
        particle_count: run.particle_count,
        snapshot_index: row.snapshot_index.unwrap_or(0),
        ..SnapshotHeader::default()
    }
}

#[pymethods]
impl Recording {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let shown = path.display().to_string();
        let tape = py.detach(|| Tape::open(&path, None, &mut |_, _| ()));
        let tape = tape.map_err(|error| tape_error(&shown, &error))?;
        Ok(Self { path: shown, tape: Mutex::new(tape) })
    }

    /// Path of the file.
    #[getter]
    fn path(&self) -> &str {
        &self.path
    }

    /// First recorded step.
    #[getter]
    fn first_step(&self) -> u64 {
        self.tape().first_step()
    }

    /// Last recorded step.
    #[getter]
    fn last_step(&self) -> u64 {
        self.tape().last_step()
    }

    /// Steps per second.
    #[getter]
    fn rate(&self) -> u32 {
        self.run(|run| run.rate_hz)
    }

    /// Name of the scene.
    #[getter]
    fn scene_name(&self) -> String {
        self.run(|run| run.scene_name.clone())
    }

    /// Number of particles.
    #[getter]
    fn particle_count(&self) -> u32 {
        self.run(|run| run.particle_count)
    }

    /// Number of the recorded run.
    #[getter]
    fn run_id(&self) -> u64 {
        self.run(|run| run.run_id)
    }

    /// Returns the scene as TOML.
    fn scene(&self) -> PyResult<String> {
        let text = String::from_utf8(self.tape().log().scene().to_vec());
        text.map_err(|_| RecordingError::new_err(format!("{}: the scene is not text", self.path)))
    }

    /// Returns the constraints.
    fn topology(&self, py: Python<'_>) -> PyResult<Topology> {
        let (header, constraints) = {
            let tape = self.tape();
            (tape.run().load_header(tape.topology()), tape.topology().constraints())
        };
        let constraints = constraints.ok_or_else(|| self.malformed("/topology"))?;
        Topology::new(py, &header, &constraints)
    }

    /// Returns the particles of each triangle of the surface. Shape: (triangles, 3).
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let triangles = self.tape().surface().triangles();
        corners(py, &triangles.ok_or_else(|| self.malformed("/surface"))?)
    }

    /// Returns the snapshot of the last recorded step up to `step`, or else the first one.
    fn at_or_before(&self, py: Python<'_>, step: u64) -> PyResult<Snapshot> {
        let (header, particles) = self.read(py, |tape| {
            let state = tape.state_at(step)?;
            Ok((header(tape.run(), &state), state.particles.to_vec()))
        })?;
        Ok(Snapshot::own(header, particles))
    }

    /// Returns the first recorded step after `step`.
    fn step_after(&self, py: Python<'_>, step: u64) -> PyResult<Option<u64>> {
        let next = self.read(py, |tape| Ok(tape.step_after(step)?))?;
        Ok((next > step).then_some(next))
    }

    /// Returns the last recorded step up to `step`, or else the first one.
    fn step_at(&self, py: Python<'_>, step: u64) -> PyResult<u64> {
        self.read(py, |tape| Ok(tape.step_at(step)?))
    }

    /// Returns the indices of the constraints that are torn at a step, in the order of tearing.
    fn torn<'py>(&self, py: Python<'py>, step: u64) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let state = self.read(py, |tape| tape.state_at(step))?;
        Ok(PyArray1::from_iter(py, state.torn.indices()))
    }

    /// Returns a table of all recorded steps, by column: `pandas.DataFrame(recording.steps())`.
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut rows = Vec::new();
        py.detach(|| {
            self.scan(|message| {
                if let Message::Step(row) = message {
                    rows.push(row);
                }
            })
        })?;
        let rate = f64::from(self.rate());
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
        let mut rows: Vec<OutcomeRow> = Vec::new();
        py.detach(|| {
            self.scan(|message| {
                if let Message::Outcome(row) = message {
                    rows.push(row);
                }
            })
        })?;
        from_json(py, &rows)
    }

    fn __repr__(&self) -> String {
        let tape = self.tape();
        let (first, last) = (tape.first_step(), tape.last_step());
        format!("<catenary.Recording '{}': steps {first} to {last}>", self.path)
    }
}

impl Recording {
    fn malformed(&self, topic: &str) -> PyErr {
        RecordingError::new_err(format!("{}: {topic} is malformed", self.path))
    }
}
