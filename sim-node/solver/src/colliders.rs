//! Colliders: where they are, and how they move.

use glam::{DVec3, Quat, Vec3};

use crate::Reason;
use crate::frame::{Frame, angular_velocity, rotation_about};
use crate::scene::{ColliderGeometry, SceneCollider};

/// The form of a collider where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Body {
    /// Free where normal x >= offset; the normal has length 1.
    Plane {
        normal: Vec3,
        offset: f32,
    },
    Box {
        center: Vec3,
        half_extents: Vec3,
        rotation: Quat,
    },
    Sphere {
        center: Vec3,
        radius: f32,
    },
    Capsule {
        a: Vec3,
        b: Vec3,
        radius: f32,
    },
    /// Particles stay inside.
    Bounds {
        min: Vec3,
        max: Vec3,
    },
}

/// One collider.
#[derive(Debug, Clone)]
pub(crate) struct Collider {
    at_load: Body,
    pub(crate) restitution: f32,
    pub(crate) friction: f32,
    velocity: DVec3,
    angular_velocity: DVec3,
    /// Where a client has put it, in place of its own motion.
    pub(crate) moved: Option<Frame>,
    /// At the start and at the end of the running step.
    start: Frame,
    end: Frame,
    /// Of the running step; those of the last one between two steps.
    pub(crate) linear: Vec3,
    pub(crate) angular: Vec3,
}

/// A collider where it is, for those who draw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedCollider {
    /// Its form and place; a plane's normal and a box's rotation have length 1.
    pub shape: ColliderGeometry,
    /// Share of the approach speed that a particle keeps.
    pub restitution: f32,
    /// Coulomb's coefficient.
    pub friction: f32,
    /// Of the last step, per second.
    pub velocity: [f32; 3],
    /// Of the last step, in rad/s.
    pub angular_velocity: [f32; 3],
}

/// A moment of the running step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    /// Shares of the step that have passed at the start and at the end of the substep.
    pub(crate) start: f32,
    pub(crate) end: f32,
}

impl Collider {
    pub(crate) fn new(scene: &SceneCollider) -> Self {
        Self {
            at_load: Body::new(&scene.shape),
            restitution: scene.restitution,
            friction: scene.friction,
            velocity: Vec3::from_array(scene.velocity).as_dvec3(),
            angular_velocity: Vec3::from_array(scene.angular_velocity).as_dvec3(),
            moved: None,
            start: Frame::AT_LOAD,
            end: Frame::AT_LOAD,
            linear: Vec3::from_array(scene.velocity),
            angular: Vec3::from_array(scene.angular_velocity),
        }
    }

    /// Bounds do not turn.
    pub(crate) fn can_take(&self, frame: &Frame) -> bool {
        frame.rotation == Quat::IDENTITY || !matches!(self.at_load, Body::Bounds { .. })
    }

    /// Puts it into a frame by the end of the next step.
    pub(crate) fn move_to(&mut self, frame: Frame) -> Result<(), Reason> {
        if !self.can_take(&frame) {
            return Err(Reason::OutOfRange);
        }
        self.moved = Some(frame);
        Ok(())
    }

    /// Places it where it is after a step that ends at that time, in seconds.
    pub(crate) fn place(&mut self, time_s: f64) {
        self.end = self.frame(time_s);
        self.start = self.end;
        let is_own = self.moved.is_none();
        self.linear = if is_own { self.velocity.as_vec3() } else { Vec3::ZERO };
        self.angular = if is_own { self.angular_velocity.as_vec3() } else { Vec3::ZERO };
    }

    /// Begins a step that ends at that time and takes `dt`, both in seconds.
    pub(crate) fn begin_step(&mut self, time_s: f64, dt: f32) {
        self.start = self.end;
        self.end = self.frame(time_s);
        if self.moved.is_some() {
            self.linear = (self.end.translation - self.start.translation) / dt;
            self.angular = angular_velocity(self.start.rotation, self.end.rotation, dt);
        }
    }

    /// Where its motion, or a client, puts it.
    fn frame(&self, time_s: f64) -> Frame {
        if let Some(moved) = self.moved {
            return moved;
        }
        let speed = self.angular_velocity.dot(self.angular_velocity).sqrt();
        if speed == 0.0 {
            return Frame { translation: (self.velocity * time_s).as_vec3(), ..Frame::AT_LOAD };
        }
        let axis = self.angular_velocity * (1.0 / speed);
        Frame::new(self.velocity * time_s, rotation_about(axis, speed * time_s))
    }

    /// Whether it is anywhere else at the end of the running step than at its start.
    pub(crate) fn is_moving(&self) -> bool {
        self.start != self.end
    }

    /// Where it is after the last step.
    pub(crate) fn placed(&self) -> PlacedCollider {
        PlacedCollider {
            shape: self.body(1.0).shape(),
            restitution: self.restitution,
            friction: self.friction,
            velocity: self.linear.to_array(),
            angular_velocity: self.angular.to_array(),
        }
    }

    /// Where it is after a share of the running step.
    pub(crate) fn body(&self, share: f32) -> Body {
        self.at_load.placed(&self.frame_at(share))
    }

    /// The point of it that turning leaves in place, after a share of the running step.
    pub(crate) fn pivot(&self, share: f32) -> Vec3 {
        self.at_load.middle() + self.frame_at(share).translation
    }

    fn frame_at(&self, share: f32) -> Frame {
        match share {
            _ if !self.is_moving() => self.end,
            0.0 => self.start,
            1.0 => self.end,
            share => self.start.towards(&self.end, share),
        }
    }
}

impl Body {
    /// As the scene gives it, its normal and its rotation brought to length 1.
    fn new(shape: &ColliderGeometry) -> Self {
        let vector = Vec3::from_array;
        match *shape {
            ColliderGeometry::Plane { normal, offset } => {
                let normal = vector(normal).as_dvec3();
                let length = normal.dot(normal).sqrt();
                Self::Plane { normal: (normal * (1.0 / length)).as_vec3(), offset }
            }
            ColliderGeometry::Box { center, half_extents, rotation } => {
                let pose = crate::Pose { translation: [0.0; 3], rotation };
                let rotation = Frame::from_pose(&pose).rotation;
                let (center, half_extents) = (vector(center), vector(half_extents));
                Self::Box { center, half_extents, rotation }
            }
            ColliderGeometry::Sphere { center, radius } => {
                Self::Sphere { center: vector(center), radius }
            }
            ColliderGeometry::Capsule { a, b, radius } => {
                Self::Capsule { a: vector(a), b: vector(b), radius }
            }
            ColliderGeometry::Bounds { min, max } => {
                Self::Bounds { min: vector(min), max: vector(max) }
            }
        }
    }

    fn shape(&self) -> ColliderGeometry {
        match *self {
            Self::Plane { normal, offset } => {
                ColliderGeometry::Plane { normal: normal.to_array(), offset }
            }
            Self::Box { center, half_extents, rotation } => ColliderGeometry::Box {
                center: center.to_array(),
                half_extents: half_extents.to_array(),
                rotation: rotation.to_array(),
            },
            Self::Sphere { center, radius } => {
                ColliderGeometry::Sphere { center: center.to_array(), radius }
            }
            Self::Capsule { a, b, radius } => {
                ColliderGeometry::Capsule { a: a.to_array(), b: b.to_array(), radius }
            }
            Self::Bounds { min, max } => {
                ColliderGeometry::Bounds { min: min.to_array(), max: max.to_array() }
            }
        }
    }

    /// Moved by a frame: turned about its own middle, then carried along.
    fn placed(&self, frame: &Frame) -> Self {
        let Frame { translation: way, rotation: turn } = *frame;
        match *self {
            Self::Plane { normal, offset } => {
                let foot = normal * offset + way;
                let is_turned = turn != Quat::IDENTITY;
                let normal = if is_turned { (turn * normal).normalize() } else { normal };
                let is_moved = is_turned || way != Vec3::ZERO;
                Self::Plane { normal, offset: if is_moved { normal.dot(foot) } else { offset } }
            }
            Self::Box { center, half_extents, rotation } => {
                let is_turned = turn != Quat::IDENTITY;
                let rotation = if is_turned { (turn * rotation).normalize() } else { rotation };
                Self::Box { center: center + way, half_extents, rotation }
            }
            Self::Sphere { center, radius } => Self::Sphere { center: center + way, radius },
            Self::Capsule { a, b, radius } => {
                let (middle, arm) = ((a + b) * 0.5, turn * ((b - a) * 0.5));
                let is_turned = turn != Quat::IDENTITY;
                let (a, b) = if is_turned { (middle - arm, middle + arm) } else { (a, b) };
                Self::Capsule { a: a + way, b: b + way, radius }
            }
            Self::Bounds { min, max } => Self::Bounds { min: min + way, max: max + way },
        }
    }

    /// What it turns about; of a plane, the point that is nearest to the origin.
    fn middle(&self) -> Vec3 {
        match *self {
            Self::Plane { normal, offset } => normal * offset,
            Self::Box { center, .. } | Self::Sphere { center, .. } => center,
            Self::Capsule { a, b, .. } => (a + b) * 0.5,
            Self::Bounds { min, max } => (min + max) * 0.5,
        }
    }
}
