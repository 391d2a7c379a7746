//! Moving frames: the motion of anchors and colliders relative to their poses at load.

use glam::{DQuat, DVec3, Quat, Vec3};
use sim_scene::checks::is_near;
use sim_scene::rotation::Pose;
use sim_types::Reason;

use crate::checks::{Context, check_finite};

/// A checked frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    pub(crate) translation: Vec3,
    /// A unit quaternion.
    pub(crate) rotation: Quat,
}

impl Frame {
    pub(crate) const AT_LOAD: Self = Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY };

    /// From a translation and a rotation in f64, each rounded once.
    pub(crate) fn new(translation: DVec3, rotation: DQuat) -> Self {
        Self { translation: translation.as_vec3(), rotation: unit(rotation) }
    }

    /// From a pose whose rotation is not 0.
    pub(crate) fn from_pose(pose: &Pose) -> Self {
        let rotation = DQuat::from_array(pose.rotation.map(f64::from));
        Self { translation: Vec3::from_array(pose.translation), rotation: unit(rotation) }
    }

    /// From a pose that a client sent. In 2-D a frame must stay in the plane.
    pub(crate) fn check(pose: &Pose, context: Context<'_>) -> Result<Self, Reason> {
        check_finite(&pose.translation)?;
        check_finite(&pose.rotation)?;
        let is_near = is_near(&pose.translation) && is_near(&pose.rotation);
        let [x, y, ..] = pose.rotation;
        let leaves_plane = pose.translation[2] != 0.0 || x != 0.0 || y != 0.0;
        if !is_near || pose.rotation == [0.0; 4] || (context.is_planar && leaves_plane) {
            return Err(Reason::OutOfRange);
        }
        Ok(Self::from_pose(pose))
    }

    /// The frame as a pose, for a keyframe.
    pub(crate) fn to_pose(self) -> Pose {
        Pose { translation: self.translation.to_array(), rotation: self.rotation.to_array() }
    }

    /// Interpolates towards another frame: linearly, and normalised-linearly for the rotation.
    pub(crate) fn towards(&self, end: &Self, share: f32) -> Self {
        let same_side = if self.rotation.dot(end.rotation) < 0.0 { -1.0 } else { 1.0 };
        let from = self.rotation * (same_side * (1.0 - share));
        Self {
            translation: self.translation * (1.0 - share) + end.translation * share,
            rotation: (from + end.rotation * share).normalize(),
        }
    }
}

/// Normalises a rotation in f64 and rounds it to f32, with the sign for which w >= 0.
fn unit(rotation: DQuat) -> Quat {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    (rotation * (sign / rotation.dot(rotation).sqrt())).as_quat()
}

/// The angular velocity from one rotation to another in `dt` seconds, in rad/s.
///
/// With s = |vector part| = sin(angle / 2), the angle is 2 asin(s). The series is exact to 1e-7 up to
/// a quarter turn per step; faster rotations have no meaningful velocity.
pub(crate) fn angular_velocity(from: Quat, to: Quat, dt: f32) -> Vec3 {
    let turn = to * from.conjugate();
    let vector = Vec3::new(turn.x, turn.y, turn.z) * if turn.w < 0.0 { -1.0 } else { 1.0 };
    let square = vector.dot(vector);
    let mut series = 0.0;
    // asin(s)/s = 1 + 1/6 s^2 (1 + 9/20 s^2 (1 + 25/42 s^2 (...))), by Horner from the inside.
    for term in (1..=12_u8).rev() {
        let odd = 2.0 * f32::from(term) - 1.0;
        series = (1.0 + series) * square * odd * odd / ((odd + 1.0) * (odd + 2.0));
    }
    vector * (2.0 * (1.0 + series) / dt)
}

#[cfg(test)]
mod tests {
    //! Rotations against the functions of the standard library.
    use sim_scene::rotation::rotation_about;

    use super::*;

    #[test]
    fn the_velocity_of_a_turn_is_its_angle_per_time() {
        for angle in [0.001_f32, 0.1, 0.5, 1.5] {
            let turn = rotation_about(DVec3::new(0.6, 0.0, 0.8), f64::from(angle)).as_quat();
            let start = rotation_about(DVec3::Y, 0.7).as_quat();
            let found = angular_velocity(start, turn * start, 0.5);
            let expected = Vec3::new(0.6, 0.0, 0.8) * (angle / 0.5);
            assert!((found - expected).length() < 1e-4 * expected.length(), "{angle}: {found}");
        }
    }

    #[test]
    fn half_of_the_way_between_two_rotations_is_half_of_their_angle() {
        let end = Frame::new(DVec3::X, rotation_about(DVec3::Z, 1.0));
        let middle = Frame::AT_LOAD.towards(&end, 0.5);
        assert!((middle.translation - Vec3::X * 0.5).length() < 1e-6);
        let turned = middle.rotation * Vec3::X;
        assert!((turned - Vec3::new(0.5_f32.cos(), 0.5_f32.sin(), 0.0)).length() < 1e-6);
    }
}
