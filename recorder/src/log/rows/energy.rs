//! The energy in a row of `/steps`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_solver::Energy;

/// The mechanical energy of a state in J, if the scene is in metres.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnergyRow {
    /// Of the free particles.
    pub kinetic: f64,
    /// Of the free particles in gravity: the sum of -m g.x, with x from the origin of the scene.
    pub potential: f64,
    /// Of the constraints and bends that are not torn.
    pub elastic: f64,
}

impl EnergyRow {
    /// Returns the sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.elastic
    }
}

impl From<Energy> for EnergyRow {
    fn from(Energy { kinetic, potential, elastic }: Energy) -> Self {
        Self { kinetic, potential, elastic }
    }
}
