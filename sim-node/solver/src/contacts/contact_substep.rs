//! Values that all contacts of a substep share.

use glam::Vec3;

/// Values that all contacts of a substep share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactSubstep {
    /// Length of the substep in seconds.
    pub(crate) h: f32,
    /// Approaches up to this speed do not bounce: 2 |g| h, twice what gravity adds in a substep.
    pub(crate) rest_speed: f32,
    /// Gain of velocity by gravity in the substep: h g.
    pub(crate) gain: Vec3,
    pub(crate) interval: Interval,
    /// Solids have no extent along z.
    pub(crate) is_planar: bool,
}

/// The time of a substep, in fractions of its step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub(crate) start: f32,
    pub(crate) end: f32,
}

impl ContactSubstep {
    /// Number of axes along which solids have an extent.
    pub(crate) fn axis_count(&self) -> usize {
        if self.is_planar { 2 } else { 3 }
    }
}
