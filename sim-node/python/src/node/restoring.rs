//! Puts a given state in place of that of the node.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use sim_contract::{Client, GivenState, ParticleState, RequestError};

use super::Node;
use crate::data::outcome::Outcome;
use crate::data::snapshot::Snapshot;
use crate::data::state::State;
use crate::error::request_error;

impl Node {
    /// Calls a function with a `State`, or with the positions and velocities of a `Snapshot`.
    pub(crate) fn with_given<R>(
        &self,
        py: Python<'_>,
        state: &Bound<'_, PyAny>,
        call: impl FnOnce(&GivenState<'_>) -> PyResult<R>,
    ) -> PyResult<R> {
        if let Ok(state) = state.cast::<State>() {
            call(&state.get().given())
        } else if let Ok(snapshot) = state.cast::<Snapshot>() {
            self.with_motion(py, &snapshot.get().to_vec()?, call)
        } else {
            Err(PyTypeError::new_err("expected a State or a Snapshot"))
        }
    }

    /// Calls a function with positions and velocities for the scene of the node.
    pub(crate) fn with_motion<R>(
        &self,
        py: Python<'_>,
        particles: &[ParticleState],
        call: impl FnOnce(&GivenState<'_>) -> PyResult<R>,
    ) -> PyResult<R> {
        let scene_hash = self.latched(py, Client::topology)?.header.scene_hash;
        call(&GivenState { scene_hash, particles, keyframe: None })
    }

    /// Gives a state to the node, and waits for the outcome.
    pub(super) fn give(
        &self,
        py: Python<'_>,
        state: &GivenState<'_>,
        timeout: f64,
    ) -> PyResult<Outcome> {
        let sent = self.call(py, |client| {
            if client.is_in_turn() {
                return Err(request_error(&RequestError::InTurn));
            }
            client.send_state(state).map_err(|error| request_error(&error))
        })?;
        let outcome = self.outcome(py, sent.sequence(), Some(timeout));
        self.call(py, |client| {
            client.take_back(sent);
            Ok(())
        })?;
        outcome?.require_applied(py)
    }
}
