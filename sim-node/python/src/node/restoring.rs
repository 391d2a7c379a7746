//! Puts a given state in place of that of the node.

use pyo3::prelude::*;
use sim_contract::{Client, GivenState, ParticleState};

use super::Node;
use crate::data::outcome::Outcome;
use crate::error::request_error;

impl Node {
    /// Gives a state to the node, and waits for the outcome.
    pub(super) fn give(
        &self,
        py: Python<'_>,
        state: &GivenState<'_>,
        timeout: f64,
    ) -> PyResult<Outcome> {
        let sent = self
            .call(py, |client| client.send_state(state).map_err(|error| request_error(&error)))?;
        let outcome = self.outcome(py, sent.sequence(), Some(timeout));
        self.call(py, |client| {
            client.take_back(sent);
            Ok(())
        })?;
        outcome?.require_applied(py)
    }

    /// Gives positions and velocities to the node.
    pub(super) fn give_motion(
        &self,
        py: Python<'_>,
        particles: &[ParticleState],
        timeout: f64,
    ) -> PyResult<Outcome> {
        let scene_hash = self.latched(py, Client::topology)?.header.scene_hash;
        self.give(py, &GivenState { scene_hash, particles, keyframe: None }, timeout)
    }
}
