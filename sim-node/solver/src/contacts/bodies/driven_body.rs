//! A rigid body of another program, as it moves in one step.

use glam::{Quat, Vec3};

use sim_types::Reason;

use crate::checks::{check_finite, is_near};
use crate::frame::Frame;
use crate::scene::definition::collider::ColliderBody;

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
    /// Torque about its center beside that of contacts, in kg unit^2 / s^2.
    pub torque: [f32; 3],
}

impl BodyMotion {
    /// Checks numbers that a client sent. In 2-D a body stays in the plane.
    pub(crate) fn check(&self, is_planar: bool) -> Result<(), Reason> {
        let Self { velocity, angular_velocity, force, torque } = self;
        let (linear, angular) = ([velocity, force], [angular_velocity, torque]);
        for vector in linear.into_iter().chain(angular) {
            check_finite(vector)?;
        }
        let leaves_plane = linear.iter().any(|vector| vector[2] != 0.0)
            || angular.iter().any(|vector| vector[..2] != [0.0; 2]);
        let is_too_fast =
            !is_near(velocity) || angular_velocity.iter().any(|axis| axis.abs() > SPIN_MAX);
        if is_too_fast || (is_planar && leaves_plane) { Err(Reason::OutOfRange) } else { Ok(()) }
    }
}

/// The copy of a body that one step moves.
///
/// Gravity, its wrench and contacts change its velocity, and the velocity moves it (semi-implicit Euler). The
/// gyroscopic torque is left to the program that owns the body: within a step it is of second order.
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
    /// `center` and `axes` are those of the collider at load.
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

    /// Pose at the start of the step, with the velocities so far.
    pub(crate) fn at_start(&self) -> BodyState {
        BodyState { frame: self.at_start, linear: self.velocity, angular: self.angular_velocity }
    }

    /// Begins a substep of `h` seconds in which gravity adds the velocity `gain`.
    pub(crate) fn begin_substep(&mut self, h: f32, gain: Vec3) {
        self.before = self.now();
        self.h = h;
        self.velocity += gain + self.force * (h * self.inverse_mass);
        self.angular_velocity += self.turned_by(self.torque * h);
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
        Frame { translation: self.before.translation + self.velocity * self.h, rotation }
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
        self.velocity += impulse * self.inverse_mass;
        self.angular_velocity += self.turned_by(arm.cross(impulse));
    }

    /// Angular velocity that an angular impulse gives.
    fn turned_by(&self, angular_impulse: Vec3) -> Vec3 {
        let axes = self.before.rotation * self.axes_at_load;
        axes * (self.inverse_inertia * (axes.conjugate() * angular_impulse))
    }
}
