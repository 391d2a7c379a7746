//! Membership in the lockstep of a node.

use std::mem;
use std::num::NonZeroU32;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use sim_contract::{Client, GivenState, LockstepError, OwnerState, RequestError, SentState};

use crate::arguments;
use crate::convert::motion;
use crate::data::action::Action;
use crate::data::forces::Forces;
use crate::data::outcome::Outcome;
use crate::data::snapshot::Snapshot;
use crate::error::{Error, lockstep_error, read_error, request_error};
use crate::node::Node;
use crate::patience::Patience;
use crate::process::OfProcess;

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
    /// A turn has begun since the joining.
    has_begun: bool,
    /// Turns that the node has computed without this member, up to the last turn.
    missed_turns: u64,
    /// Sent commands without an outcome.
    sent: Vec<Sent>,
    /// Outcomes that have arrived with the last turn.
    outcomes: Vec<sim_contract::Outcome>,
}

/// A sent command.
#[derive(Debug)]
struct Sent {
    sequence: u64,
    /// The state that it gives. The message vanishes with it, so it lives until the outcome arrives.
    _state: Option<OfProcess<SentState>>,
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

    /// Sends a command for the next step. Before the first turn, it waits for that turn, so that the first snapshot of
    /// the program shows the effect.
    fn send_in_turn(
        &self,
        py: Python<'_>,
        send: impl FnOnce(&mut Client) -> Result<(u64, Option<SentState>), RequestError> + Send,
    ) -> PyResult<u64> {
        self.require_member()?;
        let node = self.node.get();
        if !self.progress().has_begun {
            let turn = node.read(py, Patience::new(Some(self.timeout_s))?, |client, part| {
                client.next_turn(part).map_err(|error| lockstep_error(&error))
            })?;
            turn.ok_or_else(|| node.silence(py).unwrap_or_else(|error| error))?;
            self.progress().has_begun = true;
        }
        let (sequence, state) =
            node.call(py, |client| send(client).map_err(|error| request_error(&error)))?;
        let state = state.map(|state| OfProcess::new("state", state));
        self.progress().sent.push(Sent { sequence, _state: state });
        Ok(sequence)
    }

    fn give(&self, py: Python<'_>, state: &GivenState<'_>) -> PyResult<u64> {
        self.send_in_turn(py, |client| {
            client.send_state(state).map(|sent| (sent.sequence(), Some(sent)))
        })
    }

    /// Joins the lockstep, and waits for the admission.
    fn join(&self, py: Python<'_>) -> PyResult<()> {
        let node = self.node.get();
        let mut last = None;
        node.call(py, |client| {
            client.request_membership(self.every).map_err(|error| lockstep_error(&error))
        })?;
        let patience = Patience::new(Some(self.timeout_s))?;
        let joined =
            node.wait(py, patience, |client, part| match client.await_membership(part) {
                Ok(()) => Ok(Some(())),
                Err(error @ LockstepError::NotAdmitted { owner: OwnerState::Alive { .. }, .. }) => {
                    last = Some(error);
                    Ok(None)
                }
                Err(error) => Err(lockstep_error(&error)),
            })?;
        match (joined, last) {
            (None, Some(error)) => Err(lockstep_error(&with_timeout(error, self.timeout_s))),
            _ => Ok(()),
        }
    }

    /// Checks that the node has waited for this member.
    fn check_turn(&self, missed_turns: u64, step: u64) -> PyResult<()> {
        let known = mem::replace(&mut self.progress().missed_turns, missed_turns);
        let count = missed_turns.saturating_sub(known);
        if count == 0 {
            return Ok(());
        }
        Err(Error::new_err(format!(
            "the node did not wait for this member in {count} of its turns before step {step}: it has answered \
             too late, so the node went on after its --lockstep-timeout"
        )))
    }
}

/// Returns the error of the last part of a wait as that of the whole wait.
fn with_timeout(error: LockstepError, timeout_s: f64) -> LockstepError {
    let timeout = Duration::try_from_secs_f64(timeout_s).unwrap_or(Duration::MAX);
    match error {
        LockstepError::NotAdmitted { owner, .. } => LockstepError::NotAdmitted { timeout, owner },
        other => other,
    }
}

/// Returns the outcomes that have arrived, and the commands without one.
fn arrived(
    client: &mut Client,
    sent: Vec<Sent>,
) -> PyResult<(Vec<sim_contract::Outcome>, Vec<Sent>)> {
    let (mut outcomes, mut unanswered) = (Vec::new(), Vec::new());
    for command in sent {
        match client.arrived_outcome(command.sequence).map_err(|error| read_error(&error))? {
            Some(outcome) => outcomes.push(outcome),
            None => unanswered.push(command),
        }
    }
    Ok((outcomes, unanswered))
}

#[pymethods]
impl Lockstep {
    #[new]
    #[pyo3(signature = (node, every=1, *, timeout=10.0))]
    fn new(
        node: Py<Node>,
        #[pyo3(from_py_with = arguments::every)] every: u32,
        timeout: f64,
    ) -> PyResult<Self> {
        // The argument is at least 1.
        let every = NonZeroU32::new(every).unwrap_or(NonZeroU32::MIN);
        Patience::new(Some(timeout))?;
        Ok(Self { node, every, timeout_s: timeout, progress: Mutex::default() })
    }

    fn __enter__(this: Py<Self>, py: Python<'_>) -> PyResult<Py<Self>> {
        let own = this.get();
        let node = own.node.get();
        let joined = own.join(py);
        if joined.is_err() {
            // The node must not wait for a program that does not know of its membership.
            node.call(py, |client| {
                client.leave_lockstep();
                Ok(())
            })?;
        }
        joined?;
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
        for command in sent {
            match node.outcome(py, command.sequence, Some(self.timeout_s)) {
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
        let missed_turns = node.call(py, |client| Ok(client.missed_turns()))?;
        self.check_turn(missed_turns, snapshot.header().step)?;
        let sent = mem::take(&mut self.progress().sent);
        let (outcomes, sent) = node.call(py, |client| arrived(client, sent))?;
        {
            let mut progress = self.progress();
            progress.has_begun = true;
            (progress.outcomes, progress.sent) = (outcomes.clone(), sent);
        }
        let snapshot = node.show(py, snapshot)?;
        for outcome in outcomes {
            let allowed = node.allowed_indices(py, outcome.reason());
            Outcome::new(&outcome).with_allowed(allowed).require_applied(py)?;
        }
        Ok(Some(snapshot))
    }

    /// Outcomes that came with the last snapshot.
    #[getter]
    fn outcomes(&self) -> Vec<Outcome> {
        self.progress().outcomes.iter().map(Outcome::new).collect()
    }

    /// Sends an action for the next step. Returns its sequence number.
    fn send(&self, py: Python<'_>, action: &Action) -> PyResult<u64> {
        let action = action.0;
        self.send_in_turn(py, |client| client.send(action).map(|sequence| (sequence, None)))
    }

    /// Puts a state in place in the next step, which shows it without further changes. Returns the sequence number.
    ///
    /// A `State` replaces everything. A `Snapshot` replaces only positions and velocities.
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<u64> {
        self.node.get().with_given(py, state, |given| self.give(py, given))
    }

    /// Replaces the positions and velocities of all particles in the next step. Shape of both: (particles, 3).
    fn set_motion(
        &self,
        py: Python<'_>,
        positions: &Bound<'_, PyAny>,
        velocities: &Bound<'_, PyAny>,
    ) -> PyResult<u64> {
        let particles = motion(positions, velocities)?;
        self.node.get().with_motion(py, &particles, |given| self.give(py, given))
    }

    /// Returns the forces of the step of the last snapshot. None if the node has not computed them: the first call makes
    /// it compute them from the next step on.
    fn forces(&self, py: Python<'_>) -> PyResult<Option<Forces>> {
        self.require_member()?;
        self.node.get().newest_forces(py)
    }
}
