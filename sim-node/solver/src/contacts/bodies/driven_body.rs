//! A rigid body of another program, as it moves in one step.

use glam::{Quat, Vec3};
use sim_scene::scene::ColliderBody;

use sim_types::{COORDINATE_MAX, Reason};

use crate::frame::Frame;

/// Largest component of a velocity, in units per second.
const SPEED_MAX: f32 = COORDINATE_MAX;
/// Largest component of an angular velocity, in rad/s.
const SPIN_MAX: f32 = 1e4;

/// The motion of a body in the next step, as a client gives it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyMotion {
    /// Velocity of its center at the start of the step, in units per second.
    pub velocity: [f32; 3],
    /// Angular velocity at the start of the step, in rad/s.
    pub angular_velocity: [f32; 3],
    /// Force beside gravity and contacts, in kg unit / s^2.
    pub force: [f32; 3],
    /// Torque about its center beside the torque of contacts, in kg unit^2 / s^2.
    pub torque: [f32; 3],
}

impl BodyMotion {
    /// Checks that a body of a planar scene stays in the plane.
    pub(crate) fn check_in_plane(&self, is_planar: bool) -> Result<(), Reason> {
        let Self { velocity, angular_velocity, force, torque } = self;
        let (linear, angular) = ([velocity, force], [angular_velocity, torque]);
        let leaves_plane = linear.iter().any(|vector| vector[2] != 0.0)
            || angular.iter().any(|vector| vector[..2] != [0.0; 2]);
        if is_planar && leaves_plane { Err(Reason::OutOfRange) } else { Ok(()) }
    }
}

/// Returns true if no component exceeds `max`. NaN exceeds it.
fn is_within(vector: [f32; 3], max: f32) -> bool {
    vector.iter().all(|axis| axis.abs() <= max)
}

/// Returns `after`, shortened so that no component exceeds `max`, or `before` if it is not finite.
fn limited(before: Vec3, after: Vec3, max: f32) -> Vec3 {
    if is_within(after.to_array(), max) {
        return after;
    }
    let shortened = after * (max / after.abs().max_element());
    // The product may be rounded up.
    if after.is_finite() { shortened.clamp(Vec3::splat(-max), Vec3::splat(max)) } else { before }
}

/// The copy of a body that one step moves.
///
/// Gravity, its wrench and contacts change its velocity, and the velocity moves it (semi-implicit Euler). The
/// gyroscopic torque is left to the program that owns the body: within a step it is of second order.
///
/// Its velocities stay within the limits of a command. Contacts of a body with almost no inertia can give it more, which
/// f32 could not represent; the excess is lost.
#[derive(Debug, Clone)]
pub(crate) struct DrivenBody {
    inverse_mass: f32,
    /// About the own axes.
    inverse_inertia: Vec3,
    /// Rotation of the own axes at load.
    axes_at_load: Quat,
    /// Center at load.
    center_at_load: Vec3,
    force: Vec3,
    torque: Vec3,
    /// Relative to the pose at load, at the start of the step.
    at_start: Frame,
    /// Likewise, at the start of the running substep.
    before: Frame,
    /// In the running substep.
    velocity: Vec3,
    angular_velocity: Vec3,
    /// Length of a substep in seconds.
    h: f32,
}

/// Pose and velocities of a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyState {
    pub(crate) frame: Frame,
    pub(crate) linear: Vec3,
    pub(crate) angular: Vec3,
}

impl DrivenBody {
    /// `center` and `axes` belong to the collider at load.
    pub(crate) fn new(
        body: &ColliderBody,
        (center, axes): (Vec3, Quat),
        frame: Frame,
        motion: &BodyMotion,
    ) -> Self {
        let inverse_inertia = body.inertia.map(|moment| 1.0 / moment);
        Self {
            inverse_mass: 1.0 / body.mass,
            inverse_inertia: Vec3::from_array(inverse_inertia),
            axes_at_load: axes,
            center_at_load: center,
            force: Vec3::from_array(motion.force),
            torque: Vec3::from_array(motion.torque),
            at_start: frame,
            before: frame,
            velocity: Vec3::from_array(motion.velocity),
            angular_velocity: Vec3::from_array(motion.angular_velocity),
            h: 0.0,
        }
    }

    /// Returns true if its force and torque alone, in a step of `dt` seconds, keep the velocities within their limits.
    pub(crate) fn bears_wrench(&self, dt: f32) -> bool {
        let linear = self.velocity + self.force * (dt * self.inverse_mass);
        let angular = self.angular_velocity + self.turned_by(self.torque * dt);
        is_within(linear.to_array(), SPEED_MAX) && is_within(angular.to_array(), SPIN_MAX)
    }

    /// Pose at the start of the step, with the velocities so far.
    pub(crate) fn at_start(&self) -> BodyState {
        BodyState { frame: self.at_start, linear: self.velocity, angular: self.angular_velocity }
    }

    /// Begins a substep of `h` seconds in which gravity adds the velocity `gain`.
    pub(crate) fn begin_substep(&mut self, h: f32, gain: Vec3) {
        self.before = self.now();
        self.h = h;
        self.change_velocity(gain + self.force * (h * self.inverse_mass));
        self.change_angular_velocity(self.turned_by(self.torque * h));
    }

    fn change_velocity(&mut self, change: Vec3) {
        self.velocity = limited(self.velocity, self.velocity + change, SPEED_MAX);
    }

    fn change_angular_velocity(&mut self, change: Vec3) {
        let before = self.angular_velocity;
        self.angular_velocity = limited(before, before + change, SPIN_MAX);
    }

    /// Pose at the start of the running substep.
    pub(crate) fn before(&self) -> Frame {
        self.before
    }

    /// Pose at the end of the running substep, with its velocities so far.
    pub(crate) fn now(&self) -> Frame {
        let rotation = if self.angular_velocity == Vec3::ZERO {
            self.before.rotation
        } else {
            let turn = self.angular_velocity * (0.5 * self.h);
            let turn = Quat::from_xyzw(turn.x, turn.y, turn.z, 0.0);
            (self.before.rotation + turn * self.before.rotation).normalize()
        };
        let before = self.before.translation;
        // A keyframe with a frame beyond this limit is refused.
        let translation = limited(before, before + self.velocity * self.h, COORDINATE_MAX);
        Frame { translation, rotation }
    }

    /// Pose and velocities at the end of the running substep, so far.
    pub(crate) fn state(&self) -> BodyState {
        BodyState { frame: self.now(), linear: self.velocity, angular: self.angular_velocity }
    }

    /// Arm of a point about the center at the end of the substep.
    pub(crate) fn arm(&self, point: Vec3) -> Vec3 {
        point - (self.center_at_load + self.before.translation + self.velocity * self.h)
    }

    /// Displacement of the material at the end of an arm in the substep.
    pub(crate) fn displacement_at(&self, arm: Vec3) -> Vec3 {
        (self.velocity + self.angular_velocity.cross(arm)) * self.h
    }

    /// Velocity along a unit vector that a unit impulse along it gives the material at the end of an arm:
    /// 1/M + (r x n)^T I^-1 (r x n).
    pub(crate) fn inverse_mass_along(&self, arm: Vec3, direction: Vec3) -> f32 {
        let moment = arm.cross(direction);
        self.inverse_mass + moment.dot(self.turned_by(moment))
    }

    /// Inverse mass of its center.
    pub(crate) fn inverse_mass(&self) -> f32 {
        self.inverse_mass
    }

    /// Receives an impulse, times the length of the substep, at the end of an arm.
    pub(crate) fn receive(&mut self, impulse: Vec3, arm: Vec3) {
        let impulse = impulse / self.h;
        self.change_velocity(impulse * self.inverse_mass);
        self.change_angular_velocity(self.turned_by(arm.cross(impulse)));
    }

    /// Angular velocity that an angular impulse gives.
    fn turned_by(&self, angular_impulse: Vec3) -> Vec3 {
        let axes = self.before.rotation * self.axes_at_load;
        axes * (self.inverse_inertia * (axes.conjugate() * angular_impulse))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limited_vector_keeps_its_direction_and_never_exceeds_the_limit() {
        for largest in [35_898_350.0, -35_898_350.0, 2e7, 1e30, f32::MAX] {
            let after = Vec3::new(0.25 * largest, -largest, 0.5 * largest);
            let limited = limited(Vec3::ZERO, after, SPEED_MAX);
            assert!(is_within(limited.to_array(), SPEED_MAX), "{limited}");
            assert!((limited / SPEED_MAX - after / largest.abs()).length() < 1e-6, "{limited}");
        }
        let before = Vec3::ONE;
        assert_eq!(limited(before, Vec3::new(1.0, f32::NAN, 0.0), SPEED_MAX), before);
        assert_eq!(limited(before, Vec3::new(f32::INFINITY, 0.0, 0.0), SPEED_MAX), before);
    }
}
