//! The energy of recorded states.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_solver::{Energy, EnergyMeter, Scene};

use crate::scene_state::SceneState;

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
        Energy::from(*self).total()
    }
}

impl From<Energy> for EnergyRow {
    fn from(Energy { kinetic, potential, elastic }: Energy) -> Self {
        Self { kinetic, potential, elastic }
    }
}

impl From<EnergyRow> for Energy {
    fn from(EnergyRow { kinetic, potential, elastic }: EnergyRow) -> Self {
        Self { kinetic, potential, elastic }
    }
}

/// Measures the states of a recording that has not recorded their energy.
#[derive(Debug)]
pub struct RecordedEnergy(EnergyMeter);

impl RecordedEnergy {
    /// Prepares the measurement for the scene of a recording.
    pub fn new(scene: &Scene) -> Self {
        Self(EnergyMeter::new(scene))
    }

    /// Returns the recorded energy of a state, or measures it. None if its parameters are not recorded, or the state is
    /// not one of the scene.
    pub fn of(&mut self, state: &SceneState) -> Option<EnergyRow> {
        state.row.energy.or_else(|| {
            let particles = bytemuck::cast_slice(&state.particles);
            let energy =
                self.0.measure(particles, state.torn_constraints(), state.parameters.as_ref()?)?;
            Some(energy.into())
        })
    }
}
