//! A connection to a running node.

mod restoring;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use recording::{CollidersRow, StatusRow};
use sim_contract::{Client, Endpoint, OwnerState, ReadError, Reason, RequestError, SnapshotHeader};
use sim_host::clock::{SECOND_NS, monotonic_ns};

use crate::arguments;
use crate::attach::attach;
use crate::convert::{from_json, motion};
use crate::data::action::Action;
use crate::data::forces::{Forces, forces_row};
use crate::data::outcome::{Outcome, indices};
use crate::data::scene::{Bends, Topology, corners};
use crate::data::snapshot::{ForcesSource, Snapshot};
use crate::data::state::{State, current_state};
use crate::error::{
    NotRunning, Timeout, TooManySnapshots, endpoint_error, read_error, request_error,
};
use crate::patience::{Patience, wait, with_timeout};
use crate::process::OfProcess;

/// Longest wait for messages that a node has published once per load, in seconds.
const LATCHED_TIMEOUT_S: f64 = 5.0;

#[pyclass(frozen, subclass, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) endpoint: Endpoint,
    client: OfProcess<Client>,
    /// Each snapshot comes with its forces.
    reads_forces: AtomicBool,
    /// The newest snapshot that was read, which `latest` returns again until there is a newer one.
    newest: Mutex<Option<Py<Snapshot>>>,
}

impl Node {
    /// Calls `read` with parts of the wait until it returns a message. `None` after the timeout, or at the
    /// end of the node.
    pub(crate) fn read<T: Send>(
        &self,
        py: Python<'_>,
        patience: Patience,
        mut read: impl FnMut(&mut Client, Duration) -> PyResult<Option<T>> + Send,
    ) -> PyResult<Option<T>> {
        let mut attempt = |part| {
            self.client.with(|client| {
                let value = read(client, part)?;
                if value.is_some() || client.is_owner_alive() {
                    return Ok(value.map(Some));
                }
                // Its last message may have arrived meanwhile. The wait ends with nothing.
                Ok(Some(read(client, Duration::ZERO)?))
            })
        };
        let value = wait(py, patience, &mut attempt)?;
        Ok(value.flatten())
    }

    /// Calls a method of the client that does not wait.
    pub(crate) fn call<T: Send>(
        &self,
        py: Python<'_>,
        call: impl FnOnce(&mut Client) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.client.with(call))
    }

    /// Waits in parts until `attempt` returns a value. `None` after the timeout.
    pub(crate) fn wait<T: Send>(
        &self,
        py: Python<'_>,
        patience: Patience,
        mut attempt: impl FnMut(&mut Client, Duration) -> PyResult<Option<T>> + Send,
    ) -> PyResult<Option<T>> {
        wait(py, patience, |part| self.client.with(|client| attempt(client, part)))
    }

    pub(crate) fn is_running(&self, py: Python<'_>) -> PyResult<bool> {
        self.call(py, |client| Ok(client.is_owner_alive()))
    }

    /// Returns `true` if the node has reported no step after the one of the kept snapshot.
    fn is_kept_newest(&self, py: Python<'_>) -> PyResult<bool> {
        let status = self.latched(py, Client::status)?;
        let kept = self.newest();
        Ok(kept.as_ref().is_some_and(|snapshot| {
            let header = snapshot.get().header();
            status.run_id == header.run_id && status.step <= header.step
        }))
    }

    /// Returns the allowed indices after the rejection of an unknown one, if the node tells them.
    pub(crate) fn allowed_indices(&self, py: Python<'_>, reason: Option<Reason>) -> Option<String> {
        let status = || self.latched(py, Client::status).ok();
        let count = match reason? {
            Reason::UnknownParticle => status()?.particle_count as usize,
            Reason::UnknownConstraint => status()?.constraint_count as usize,
            Reason::UnknownCollider => {
                let read = |client: &mut Client, part| client.colliders(part).map(Some);
                self.latched(py, read).ok()?.colliders.len()
            }
            _ => return None,
        };
        Some(indices(count))
    }

    /// Reads what the node has published once.
    pub(crate) fn latched<T: Send>(
        &self,
        py: Python<'_>,
        mut read: impl FnMut(&mut Client, Duration) -> Result<Option<T>, ReadError> + Send,
    ) -> PyResult<T> {
        let patience = Patience::new(Some(LATCHED_TIMEOUT_S))?;
        let read = |client: &mut Client, part| read(client, part).map_err(|e| read_error(&e));
        let message = self.read(py, patience, read)?;
        message.map_or_else(|| Err(self.silence(py)?), Ok)
    }

    /// Returns the exception for a node that did not answer.
    pub(crate) fn silence(&self, py: Python<'_>) -> PyResult<PyErr> {
        let endpoint = &self.endpoint;
        Ok(if self.is_running(py)? {
            Timeout::new_err(format!(
                "{endpoint} publishes nothing: is it paused, stopped or overloaded?"
            ))
        } else {
            NotRunning::new_err(format!("no node runs as {endpoint} now"))
        })
    }

    /// Reads a snapshot. If the program holds too many, the one that this node keeps makes room.
    fn read_snapshot(
        &self,
        py: Python<'_>,
        patience: Patience,
        read: fn(&mut Client, Duration) -> Result<Option<sim_contract::Snapshot>, ReadError>,
    ) -> PyResult<Option<sim_contract::Snapshot>> {
        let read = |client: &mut Client, part| read(client, part).map_err(|e| read_error(&e));
        match self.read(py, patience, read) {
            Err(error) if error.is_instance_of::<TooManySnapshots>(py) => {
                let kept = self.newest().take();
                drop(kept);
                self.read(py, patience, read)
            }
            result => result,
        }
    }

    fn newest(&self) -> MutexGuard<'_, Option<Py<Snapshot>>> {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes an object of a snapshot, and keeps it as the newest one.
    pub(crate) fn show(
        &self,
        py: Python<'_>,
        snapshot: sim_contract::Snapshot,
    ) -> PyResult<Py<Snapshot>> {
        let forces = self.forces_of(py, snapshot.header())?;
        let snapshot = Py::new(py, Snapshot::shared(snapshot, forces))?;
        let replaced = self.newest().replace(snapshot.clone_ref(py));
        // Outside of the lock, because it may run code of Python.
        drop(replaced);
        Ok(snapshot)
    }

    /// Returns the forces of the step of a snapshot, which the node has published before it.
    fn forces_of(&self, py: Python<'_>, header: &SnapshotHeader) -> PyResult<ForcesSource> {
        if !self.reads_forces.load(Ordering::Relaxed) {
            return Ok(ForcesSource::Unread("attach with `catenary.attach(..., forces=True)`"));
        }
        let read = |client: &mut Client| client.forces_of(header, Duration::ZERO);
        let forces = self.call(py, |client| read(client).map_err(|e| read_error(&e)))?;
        let row = |forces| Ok::<_, PyErr>((forces_row(&forces)?, forces.header.rate_hz));
        Ok(ForcesSource::Read(forces.map(row).transpose()?))
    }

    /// Attaches with an id, or with a random one. With `reads_forces`, the node computes forces from its next step on.
    fn connect(
        py: Python<'_>,
        endpoint: Endpoint,
        client_id: Option<u64>,
        timeout: f64,
        reads_forces: bool,
    ) -> PyResult<Self> {
        let client = attach(py, &endpoint, client_id, timeout)?;
        let client = OfProcess::new("node", client);
        let (reads_none, newest) = (AtomicBool::new(false), Mutex::default());
        let node = Self { endpoint, client, reads_forces: reads_none, newest };
        if reads_forces {
            node.begin_forces(py)?;
        }
        Ok(node)
    }

    /// Lets each snapshot come with its forces, which the node computes from its next step on.
    fn begin_forces(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, |client| client.forces(Duration::ZERO).map_err(|e| read_error(&e)))?;
        self.reads_forces.store(true, Ordering::Relaxed);
        Ok(())
    }

    /// Returns the forces of the step of the newest snapshot that was read. `None` if they were not computed.
    pub(crate) fn newest_forces(&self, py: Python<'_>) -> PyResult<Option<Forces>> {
        if !self.reads_forces.load(Ordering::Relaxed) {
            self.begin_forces(py)?;
        }
        let newest = self.newest().as_ref().map(|snapshot| snapshot.clone_ref(py));
        newest.map_or(Ok(None), |snapshot| snapshot.get().forces_read(py))
    }
}

#[pymethods]
impl Node {
    #[new]
    #[pyo3(signature = (name="sim", *, domain=None, timeout=0.0, client_id=None, forces=false))]
    #[allow(clippy::too_many_arguments, reason = "these are the keywords of Python")]
    fn new(
        py: Python<'_>,
        name: &str,
        domain: Option<&str>,
        timeout: f64,
        #[pyo3(from_py_with = arguments::client_id)] client_id: Option<u64>,
        forces: bool,
    ) -> PyResult<Self> {
        let endpoint = Endpoint::from_options(domain, Some(name));
        let endpoint = endpoint.map_err(|error| endpoint_error(&error))?;
        Self::connect(py, endpoint, client_id, timeout, forces)
    }

    /// Returns another connection to the same node, with an id and a queue of snapshots of its own.
    fn another(&self, py: Python<'_>) -> PyResult<Self> {
        let reads_forces = self.reads_forces.load(Ordering::Relaxed);
        Self::connect(py, self.endpoint.clone(), None, 0.0, reads_forces)
    }

    /// Id of this client in outcomes and recordings.
    #[getter]
    fn client_id(&self, py: Python<'_>) -> PyResult<u64> {
        self.call(py, |client| Ok(client.client_id()))
    }

    /// True if a process runs under the name. Reads the file system: ask a few times per second at most.
    #[getter(is_running)]
    fn is_running_now(&self, py: Python<'_>) -> PyResult<bool> {
        self.is_running(py)
    }

    /// Detaches. Snapshots that are still held stay valid.
    fn close(&self, py: Python<'_>) {
        let kept = self.newest().take();
        drop(kept);
        py.detach(|| self.client.close());
    }

    /// Returns the oldest unread snapshot, or waits for the next one. None if the node has ended.
    ///
    /// `latest` reads from the same queue, and skips what is in it; `snapshots` has a queue of its own.
    ///
    /// Raises `Timeout` if none comes in time, and `TooManySnapshots` if the program holds too many.
    #[pyo3(signature = (timeout=None))]
    fn next_snapshot(
        &self,
        py: Python<'_>,
        timeout: Option<f64>,
    ) -> PyResult<Option<Py<Snapshot>>> {
        let patience = Patience::new(timeout)?;
        match self.read_snapshot(py, patience, Client::next_snapshot)? {
            Some(snapshot) => self.show(py, snapshot).map(Some),
            None if self.is_running(py)? => Err(self.silence(py)?),
            None => Ok(None),
        }
    }

    /// Returns the newest snapshot. Waits only for the first one.
    ///
    /// Raises `TooManySnapshots` if the program holds too many to read a newer one.
    #[pyo3(signature = (timeout=5.0))]
    fn latest(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<Py<Snapshot>> {
        let patience = Patience::new(timeout)?;
        let read = |client: &mut Client| {
            client.latest_snapshot(Duration::ZERO).map_err(|error| read_error(&error))
        };
        let newer = match self.call(py, read) {
            Err(error) if error.is_instance_of::<TooManySnapshots>(py) => {
                if self.is_kept_newest(py)? {
                    None
                } else {
                    // The kept one makes room, unless the program holds it, too.
                    let kept = self.newest().take();
                    drop(kept);
                    self.call(py, read)?
                }
            }
            newer => newer?,
        };
        if let Some(snapshot) = newer {
            return self.show(py, snapshot);
        }
        let kept = self.newest().as_ref().map(|snapshot| snapshot.clone_ref(py));
        if let Some(snapshot) = kept
            && (is_recent(snapshot.get().header()) || self.is_running(py)?)
        {
            return Ok(snapshot);
        }
        match self.read_snapshot(py, patience, Client::latest_snapshot)? {
            Some(snapshot) => self.show(py, snapshot),
            None => Err(self.silence(py)?),
        }
    }

    /// Returns the constraints.
    fn topology(&self, py: Python<'_>) -> PyResult<Topology> {
        let topology = self.latched(py, Client::topology)?;
        Topology::new(py, &topology.header, &topology.constraints)
    }

    /// Returns the bends.
    fn bends(&self, py: Python<'_>) -> PyResult<Bends> {
        Bends::new(py, &self.latched(py, Client::bends)?.bends)
    }

    /// Returns the particles of each triangle of the surface. Shape: (triangles, 3).
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        corners(py, &self.latched(py, Client::surface)?.triangles)
    }

    /// Returns the scene as TOML, with every default written out.
    fn scene(&self, py: Python<'_>) -> PyResult<String> {
        self.latched(py, Client::scene)
    }

    /// Returns the current parameters by name. None is off.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.latched(py, Client::parameters)?.values)
    }

    /// Returns the status of the node, with the keys of `/status` in recordings.
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &StatusRow::from(&self.latched(py, Client::status)?))
    }

    /// Returns the indices of the torn constraints, in the order of tearing.
    fn torn<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let torn = self.latched(py, |client, part| {
            Ok(Some(client.torn(part)?).filter(|torn| torn.header.run_id != 0))
        })?;
        Ok(PyArray1::from_iter(py, torn.indices()))
    }

    /// Returns the colliders in their newest poses.
    fn colliders<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let colliders = self.latched(py, |client, part| {
            Ok(Some(client.colliders(part)?).filter(|list| list.header.run_id != 0))
        })?;
        let row = CollidersRow::new(colliders.header.step, &colliders.colliders);
        from_json(py, &row.map_or_else(Vec::new, |row| row.colliders))
    }

    /// Returns the newest forces on colliders, anchors and fixed particles. Waits only if none have arrived.
    ///
    /// The node computes them only while a client reads them: the first call waits for the next step, and from then
    /// on each step costs the node a little more time, until `close`. A paused node has none until its next step, and
    /// a replay only those of a recording that was made with `--forces`. `snapshot.forces` reads from the same queue:
    /// a snapshot from before the forces that this returned has none then.
    ///
    /// Raises `Timeout` if there are none in time.
    #[pyo3(signature = (timeout=5.0))]
    fn forces(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<Forces> {
        let read = |client: &mut Client, part| client.forces(part).map_err(|e| read_error(&e));
        match self.read(py, Patience::new(timeout)?, read)? {
            Some(forces) => Forces::new(py, &forces_row(&forces)?, forces.header.rate_hz),
            None if self.is_running(py)? => Err(Timeout::new_err(format!(
                "{} publishes no forces: is it paused (forces are those of a step), or a replay of a recording \
                 without them (`recorder record --forces`)?",
                self.endpoint
            ))),
            None => Err(self.silence(py)?),
        }
    }

    /// Sends an action without waiting. Returns its sequence number, for `outcome`.
    fn send(&self, py: Python<'_>, action: &Action) -> PyResult<u64> {
        let action = action.0;
        self.call(py, |client| {
            if client.is_in_turn() {
                return Err(request_error(&RequestError::InTurn));
            }
            client.send(action).map_err(|error| request_error(&error))
        })
    }

    /// Waits for the outcome of a sent action, applied or rejected.
    #[pyo3(signature = (sequence, timeout=5.0))]
    pub(crate) fn outcome(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::sequence)] sequence: u64,
        timeout: Option<f64>,
    ) -> PyResult<Outcome> {
        let patience = Patience::new(timeout)?;
        let mut last = None;
        let outcome =
            self.wait(py, patience, |client, part| match client.outcome(sequence, part) {
                Ok(outcome) => Ok(Some(outcome)),
                Err(error @ RequestError::Timeout { owner: OwnerState::Gone { .. }, .. }) => {
                    Err(request_error(&error))
                }
                Err(
                    error @ (RequestError::Timeout { .. } | RequestError::OutcomesMissed { .. }),
                ) => {
                    last = Some(error);
                    Ok(None)
                }
                Err(error) => Err(request_error(&error)),
            })?;
        match (outcome, last) {
            (Some(outcome), _) => {
                let allowed = self.allowed_indices(py, outcome.reason());
                Ok(Outcome::new(&outcome).with_allowed(allowed))
            }
            (None, Some(error)) => Err(request_error(&with_timeout(error, timeout))),
            (None, None) => Err(self.silence(py)?),
        }
    }

    /// Sends an action and waits for its outcome. Raises `Rejected` if it was rejected.
    #[pyo3(signature = (action, timeout=5.0))]
    fn request(&self, py: Python<'_>, action: &Action, timeout: Option<f64>) -> PyResult<Outcome> {
        Patience::new(timeout)?;
        let sequence = self.send(py, action)?;
        self.outcome(py, sequence, timeout)?.require_applied(py)
    }

    /// Puts a state in place, and continues from it.
    ///
    /// A `State` replaces everything. A `Snapshot` replaces only positions and velocities.
    #[pyo3(signature = (state, timeout=5.0))]
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>, timeout: f64) -> PyResult<Outcome> {
        Patience::new(Some(timeout))?;
        self.with_given(py, state, |given| self.give(py, given, timeout))
    }

    /// Replaces the positions and velocities of all particles. Shape of both: (particles, 3).
    #[pyo3(signature = (positions, velocities, timeout=5.0))]
    fn set_motion(
        &self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        velocities: &Bound<'_, PyAny>,
        timeout: f64,
    ) -> PyResult<Outcome> {
        Patience::new(Some(timeout))?;
        let particles = motion(positions, velocities)?;
        self.with_motion(py, &particles, |given| self.give(py, given, timeout))
    }

    /// Returns the newest complete state, which `restore` puts in place again.
    fn state(&self, py: Python<'_>) -> PyResult<State> {
        current_state(py, &self.endpoint)
    }

    fn __repr__(&self) -> String {
        format!("<catenary.Node {}>", self.endpoint)
    }
}

/// Returns `true` for a snapshot that its node has published just now. One from the future has the clock of
/// another host, so its age is unknown.
fn is_recent(header: &SnapshotHeader) -> bool {
    let age_ns = monotonic_ns().checked_sub(header.publish_monotonic_ns);
    age_ns.is_some_and(|age_ns| age_ns < SECOND_NS / 2)
}

impl Drop for Node {
    /// A client waits briefly for the outcomes of its commands: other threads run meanwhile.
    fn drop(&mut self) {
        let closed = Python::try_attach(|py| py.detach(|| self.client.close()));
        if closed.is_none() {
            self.client.close();
        }
    }
}
