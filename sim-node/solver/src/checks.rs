//! Checks of numbers from outside.

use sim_types::{COORDINATE_MAX, Method, Reason, STEP_WORK_MAX};

/// Properties of a scene against which values are checked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) method: Method,
    pub(crate) is_planar: bool,
    pub(crate) has_bends: bool,
    /// By generated block: it has bends.
    pub(crate) bent_blocks: &'a [bool],
    pub(crate) size: StepSize,
}

/// Sizes of a scene that determine the work of a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepSize {
    pub(crate) particles: u64,
    /// Constraints and bends.
    pub(crate) constraints: u64,
    pub(crate) colliders: u64,
}

impl StepSize {
    /// Work of a step, in the unit of [`STEP_WORK_MAX`]. A count of passes is at most 1000, so only
    /// sizes that no scene has could overflow.
    pub(crate) fn work(self, substeps: u32, iterations: u32) -> u64 {
        let Self { particles, constraints, colliders } = self;
        let projections = constraints.saturating_mul(iterations.into());
        let motions = particles.saturating_mul(colliders.saturating_add(1));
        projections.saturating_add(motions).saturating_mul(substeps.into())
    }

    /// Returns true if the work of a step is within [`STEP_WORK_MAX`].
    pub(crate) fn allows(self, substeps: u32, iterations: u32) -> bool {
        self.work(substeps, iterations) <= STEP_WORK_MAX
    }
}

/// Returns true if no coordinate exceeds [`COORDINATE_MAX`].
pub(crate) fn is_near(coordinates: &[f32]) -> bool {
    coordinates.iter().all(|coordinate| coordinate.abs() <= COORDINATE_MAX)
}

pub(crate) fn check_finite(numbers: &[f32]) -> Result<(), Reason> {
    let is_finite = numbers.iter().all(|number| number.is_finite());
    if is_finite { Ok(()) } else { Err(Reason::NonFinite) }
}
