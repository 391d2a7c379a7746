//! Driven particles: they move to a target, whatever forces act on them.

use serde::{Deserialize, Serialize};

use super::substep::Substep;
use crate::motion::Motion;
use crate::store::{Location, ParticleStore};

/// Longest time in seconds for which a grabbed particle heads for one point. A longer motion has points between.
pub(crate) const GRAB_HORIZON_S: f32 = 0.25;

/// Most substeps for which a particle in a longer motion heads for one point. A slow particle moves once its share of the
/// way exceeds half of the rounding of its position, so it is at most half of this number of roundings behind.
pub(crate) const GRAB_HORIZON_SUBSTEPS: u32 = 256;

/// A grabbed particle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ActiveGrab {
    pub(crate) particle: u32,
    pub(crate) client_id: u64,
    pub(crate) target: [f32; 3],
    /// Steps until the target is reached.
    pub(crate) steps_left: u32,
    /// The motion that sets the target in each step, if it is longer than the horizon or has several points. A keyframe
    /// has it behind its other fields.
    #[serde(skip)]
    pub(crate) motion: Option<Motion>,
}

impl ActiveGrab {
    /// The grab as a keyframe has it.
    pub(crate) fn without_motion(&self) -> Self {
        Self { motion: None, ..*self }
    }
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

/// Sets the targets for the step that ends as `scene_step`.
pub(crate) fn begin_grabs(grabs: &mut [ActiveGrab], scene_step: u64, horizon: u32) {
    for grab in grabs {
        if let Some(motion) = &grab.motion {
            let (target, steps) = motion.aim(scene_step, horizon);
            (grab.target, grab.steps_left) = (target.to_array(), steps);
        }
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
    // The count is exact up to 2^24 substeps. A target is at most 0.25 s of 10^5 steps of 10^3
    // substeps away, where its rounding changes the share by less than the rounding of the path.
    let share =
        |axis: usize| (target.position[axis] - position[axis]) / target.substeps_left as f32;
    let path = [share(0), share(1), share(2)];
    let length = (path[0] * path[0] + path[1] * path[1] + path[2] * path[2]).sqrt();
    let scale = if length > reach { reach / length } else { 1.0 };
    store.set_displacement(location, path.map(|axis| axis * scale));
}
