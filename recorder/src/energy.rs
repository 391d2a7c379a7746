//! The energy of recorded states.

use sim_solver::{EnergyMeter, Scene};

use crate::log::EnergyRow;
use crate::scene_state::SceneState;

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
