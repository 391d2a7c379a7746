//! The motion of a body through the next step.

use serde::Deserialize;
use sim_contract::Action;

/// The fields of `drive_body`, as in [`Action::DriveBody`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "PROTOCOL.md describes every field with its unit and range")]
pub struct BodyDrive {
    pub collider: u32,
    pub translation: [f32; 3],
    #[serde(default = "no_rotation")]
    pub rotation: [f32; 4],
    #[serde(default)]
    pub velocity: [f32; 3],
    #[serde(default)]
    pub angular_velocity: [f32; 3],
    #[serde(default)]
    pub force: [f32; 3],
    #[serde(default)]
    pub torque: [f32; 3],
}

/// The rotation of a pose that differs from that at load only by its translation.
pub(super) fn no_rotation() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

impl BodyDrive {
    /// Returns the action of the node.
    pub(crate) fn action(self) -> Action {
        let Self { collider, translation, rotation, velocity, angular_velocity, force, torque } =
            self;
        Action::DriveBody {
            collider,
            translation,
            rotation,
            velocity,
            angular_velocity,
            force,
            torque,
        }
    }
}
