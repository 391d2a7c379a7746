//! Membership in the lockstep of a node.

use std::mem;
use std::num::NonZeroU32;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use sim_contract::{Client, SnapshotHeader};

use crate::data::action::Action;
use crate::data::outcome::Outcome;
use crate::data::snapshot::Snapshot;
use crate::error::{Error, lockstep_error, read_error, request_error};
use crate::node::Node;
use crate::patience::{Patience, whole};

#[pyclass(frozen, subclass, module = "catenary")]
#[derive(Debug)]
pub(crate) struct Lockstep {
    node: Py<Node>,
    every: NonZeroU32,
    timeout_s: f64,
    progress: Mutex<Progress>,
}

/// Progress of a member.
#[derive(Debug, Default)]
struct Progress {
    is_member: bool,
    /// Header of the last turn.
    last: Option<SnapshotHeader>,
    /// Sequence numbers of sent commands without an outcome.
    sent: Vec<u64>,
    /// Outcomes that have arrived with the last turn.
    outcomes: Vec<sim_contract::Outcome>,
}

impl Lockstep {
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn require_member(&self) -> PyResult<()> {
        if self.progress().is_member {
            return Ok(());
        }
        Err(Error::new_err("not in the lockstep: use `with node.lockstep() as steps:`"))
    }

    /// Checks that the node has waited for this member.
    fn check_turn(&self, header: &SnapshotHeader) -> PyResult<()> {
        let every = u64::from(self.every.get());
        let last = self.progress().last.replace(*header);
        let Some(last) = last.filter(|last| last.run_id == header.run_id && header.stride == 1)
        else {
            return Ok(());
        };
        let expected = (last.step / every + 1) * every;
        if header.step == expected {
            return Ok(());
        }
        Err(Error::new_err(format!(
            "the node did not wait for this member at step {expected} (now at step {}): it has answered \
             too late, so the node went on after its --lockstep-timeout",
            header.step
        )))
    }
}

/// Returns the outcomes that have arrived, and the sequence numbers without one.
fn arrived(
    client: &mut Client,
    sent: Vec<u64>,
) -> PyResult<(Vec<sim_contract::Outcome>, Vec<u64>)> {
    let (mut outcomes, mut unanswered) = (Vec::new(), Vec::new());
    for sequence in sent {
        match client.arrived_outcome(sequence).map_err(|error| read_error(&error))? {
            Some(outcome) => outcomes.push(outcome),
            None => unanswered.push(sequence),
        }
    }
    Ok((outcomes, unanswered))
}

#[pymethods]
impl Lockstep {
    #[new]
    #[pyo3(signature = (node, every=1, *, timeout=10.0))]
    fn new(node: Py<Node>, every: u32, timeout: f64) -> PyResult<Self> {
        let every = NonZeroU32::new(every)
            .ok_or_else(|| PyValueError::new_err("`every` is 0 (allowed: 1 or more)"))?;
        whole(timeout)?;
        Ok(Self { node, every, timeout_s: timeout, progress: Mutex::default() })
    }

    fn __enter__(this: Py<Self>, py: Python<'_>) -> PyResult<Py<Self>> {
        let own = this.get();
        let timeout = whole(own.timeout_s)?;
        own.node.get().call(py, |client| {
            let joined = client.join_lockstep_every(own.every, timeout);
            joined.map_err(|error| lockstep_error(&error))
        })?;
        *own.progress() = Progress { is_member: true, ..Progress::default() };
        Ok(this)
    }

    fn __exit__(
        &self,
        py: Python<'_>,
        kind: &Bound<'_, PyAny>,
        _value: &Bound<'_, PyAny>,
        _traceback: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let sent = {
            let mut progress = self.progress();
            progress.is_member = false;
            mem::take(&mut progress.sent)
        };
        let node = self.node.get();
        // A closed node has left already.
        let left = node.call(py, |client| {
            client.leave_lockstep();
            Ok(())
        });
        if left.is_err() || !kind.is_none() {
            return Ok(());
        }
        // The commands of the last turn. A node that ends does not answer them.
        for sequence in sent {
            match node.outcome(py, sequence, Some(self.timeout_s)) {
                Ok(outcome) => _ = outcome.require_applied(py)?,
                Err(_) => break,
            }
        }
        Ok(())
    }

    fn __iter__(this: Py<Self>) -> Py<Self> {
        this
    }

    /// Ends the turn, and waits for the next one. `None` at the end of the node.
    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Py<Snapshot>>> {
        self.require_member()?;
        let node = self.node.get();
        node.call(py, |client| client.ready().map_err(|error| lockstep_error(&error)))?;
        let snapshot = node.read(py, Patience::new(None)?, |client, part| {
            client.next_turn(part).map_err(|error| lockstep_error(&error))
        })?;
        let Some(snapshot) = snapshot else { return Ok(None) };
        self.check_turn(snapshot.header())?;
        let sent = mem::take(&mut self.progress().sent);
        let (outcomes, sent) = node.call(py, |client| arrived(client, sent))?;
        {
            let mut progress = self.progress();
            (progress.outcomes, progress.sent) = (outcomes.clone(), sent);
        }
        let snapshot = node.show(py, snapshot)?;
        for outcome in outcomes {
            Outcome(outcome).require_applied(py)?;
        }
        Ok(Some(snapshot))
    }

    /// Outcomes that came with the last snapshot.
    #[getter]
    fn outcomes(&self) -> Vec<Outcome> {
        self.progress().outcomes.iter().copied().map(Outcome).collect()
    }

    /// Sends an action for the next step. Returns its sequence number.
    fn send(&self, py: Python<'_>, action: &Action) -> PyResult<u64> {
        self.require_member()?;
        let action = action.0;
        let node = self.node.get();
        let sequence =
            node.call(py, |client| client.send(action).map_err(|error| request_error(&error)))?;
        self.progress().sent.push(sequence);
        Ok(sequence)
    }
}
