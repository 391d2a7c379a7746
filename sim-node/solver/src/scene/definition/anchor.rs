//! Anchors: particles that follow a moving frame.

use serde::Serialize;

use super::decimal;

/// Rotation that leaves everything in place.
pub(crate) const NO_ROTATION: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// Particles that follow a moving frame. Each is driven to origin + R (start - origin) +
/// translation. A pin on an anchored particle has no effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneAnchor {
    /// Indices, ascending. A particle follows at most one anchor.
    pub particles: Vec<u32>,
    /// Fixed point of the rotations.
    #[serde(with = "decimal::vector")]
    pub origin: [f32; 3],
    /// Starts the path again when it ends.
    pub repeat: bool,
    /// Poses of the frame over time. The frame moves linearly between them, and stands still
    /// before the first and after the last.
    pub path: Vec<Waypoint>,
}

/// Pose of a frame at a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Waypoint {
    /// Seconds since the scene's step 0, >= 0.
    pub time: f64,
    /// Relative to the frame's position at load.
    #[serde(with = "decimal::vector")]
    pub translation: [f32; 3],
    /// Quaternion x, y, z, w. It is normalised on use.
    #[serde(with = "decimal::quaternion")]
    pub rotation: [f32; 4],
}
