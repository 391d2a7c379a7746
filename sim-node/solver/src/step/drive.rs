//! Driven particles: they move to a target, whatever forces act on them.

use serde::{Deserialize, Serialize};

use super::substep::Substep;
use crate::store::{Location, ParticleStore};

/// Longest time in seconds that a grabbed particle may take to its target.
pub const GRAB_OVER_S_MAX: f32 = 0.25;

/// A grabbed particle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ActiveGrab {
    pub(crate) particle: u32,
    pub(crate) client_id: u64,
    pub(crate) target: [f32; 3],
    /// Steps until the target is reached.
    pub(crate) steps_left: u32,
}

/// Target of a driven particle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DriveTarget {
    pub(crate) position: [f32; 3],
    /// Substeps until the target is reached, the running one included.
    pub(crate) substeps_left: u32,
}

/// Drives each grabbed particle by its share of the straight path to its target, but not farther
/// than `reach` (`max_speed` h) in one substep.
pub(crate) fn drive_grabbed(
    store: &mut ParticleStore,
    grabs: &[ActiveGrab],
    substep: Substep,
    reach: f32,
) {
    for grab in grabs {
        let substeps_left = (grab.steps_left.max(1) - 1) * substep.count + substep.left();
        let target = DriveTarget { position: grab.target, substeps_left };
        drive_towards(store, store.location(grab.particle), target, reach);
    }
}

/// Counts a step of every grab.
pub(crate) fn count_step(grabs: &mut [ActiveGrab]) {
    for grab in grabs {
        grab.steps_left = grab.steps_left.saturating_sub(1);
    }
}

/// Sets the displacement of a driven particle to its share of the path to the target.
pub(crate) fn drive_towards(
    store: &mut ParticleStore,
    location: Location,
    target: DriveTarget,
    reach: f32,
) {
    let position = store.position(location);
    // The count is exact up to 2^24 substeps. A grab lasts at most 0.25 s of 10^5 steps of 10^3
    // substeps, where its rounding changes the share by less than the rounding of the path.
    let share =
        |axis: usize| (target.position[axis] - position[axis]) / target.substeps_left as f32;
    let path = [share(0), share(1), share(2)];
    let length = (path[0] * path[0] + path[1] * path[1] + path[2] * path[2]).sqrt();
    let scale = if length > reach { reach / length } else { 1.0 };
    store.set_displacement(location, path.map(|axis| axis * scale));
}
