//! Checks of numbers that scenes and commands share.

use sim_types::{COORDINATE_MAX, STEP_WORK_MAX};

/// Sizes of a scene that determine the work of a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepSize {
    /// Particles.
    pub particles: u64,
    /// Constraints and bends.
    pub constraints: u64,
    /// Colliders.
    pub colliders: u64,
}

impl StepSize {
    /// Work of a step, in the unit of [`STEP_WORK_MAX`]. A count of passes is at most 1000, so only
    /// sizes that no scene has could overflow.
    pub fn work(self, substeps: u32, iterations: u32) -> u64 {
        let Self { particles, constraints, colliders } = self;
        let projections = constraints.saturating_mul(iterations.into());
        let motions = particles.saturating_mul(colliders.saturating_add(1));
        projections.saturating_add(motions).saturating_mul(substeps.into())
    }

    /// Returns true if the work of a step is within [`STEP_WORK_MAX`].
    pub fn allows(self, substeps: u32, iterations: u32) -> bool {
        self.work(substeps, iterations) <= STEP_WORK_MAX
    }
}

/// Returns true if no coordinate exceeds [`COORDINATE_MAX`].
pub fn is_near(coordinates: &[f32]) -> bool {
    coordinates.iter().all(|coordinate| coordinate.abs() <= COORDINATE_MAX)
}
