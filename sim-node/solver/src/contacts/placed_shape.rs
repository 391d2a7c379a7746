//! Shapes of colliders at their current pose.

use glam::{Quat, Vec3};
use sim_scene::rotation::Pose;
use sim_scene::scene::ColliderGeometry;

use crate::frame::Frame;

/// The shape of a collider at its current pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PlacedShape {
    /// Particles are free where normal x >= offset; the normal is a unit vector.
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
    /// The triangles are those of the collider.
    Mesh {
        center: Vec3,
        rotation: Quat,
        distance: f32,
    },
}

impl PlacedShape {
    /// From the definition in a scene, with the normal and the rotation normalised.
    pub(crate) fn new(shape: &ColliderGeometry) -> Self {
        let vector = Vec3::from_array;
        match *shape {
            ColliderGeometry::Plane { normal, offset } => {
                let normal = vector(normal).as_dvec3();
                let length = normal.dot(normal).sqrt();
                Self::Plane { normal: (normal * (1.0 / length)).as_vec3(), offset }
            }
            ColliderGeometry::Box { center, half_extents, rotation } => {
                let (center, half_extents) = (vector(center), vector(half_extents));
                Self::Box { center, half_extents, rotation: unit(rotation) }
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
            ColliderGeometry::Mesh { center, rotation, distance } => {
                Self::Mesh { center: vector(center), rotation: unit(rotation), distance }
            }
        }
    }

    pub(crate) fn to_scene(self) -> ColliderGeometry {
        match self {
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
            Self::Mesh { center, rotation, distance } => ColliderGeometry::Mesh {
                center: center.to_array(),
                rotation: rotation.to_array(),
                distance,
            },
        }
    }

    /// Applies a frame: rotates the shape about its own center, then translates it.
    pub(crate) fn moved(&self, frame: &Frame) -> Self {
        let Frame { translation, rotation: turn } = *frame;
        match *self {
            Self::Plane { normal, offset } => {
                let foot = normal * offset + translation;
                let is_turned = turn != Quat::IDENTITY;
                let normal = if is_turned { (turn * normal).normalize() } else { normal };
                let is_moved = is_turned || translation != Vec3::ZERO;
                Self::Plane { normal, offset: if is_moved { normal.dot(foot) } else { offset } }
            }
            Self::Box { center, half_extents, rotation } => {
                let rotation = turned(rotation, turn);
                Self::Box { center: center + translation, half_extents, rotation }
            }
            Self::Sphere { center, radius } => {
                Self::Sphere { center: center + translation, radius }
            }
            Self::Capsule { a, b, radius } => {
                let (middle, arm) = ((a + b) * 0.5, turn * ((b - a) * 0.5));
                let is_turned = turn != Quat::IDENTITY;
                let (a, b) = if is_turned { (middle - arm, middle + arm) } else { (a, b) };
                Self::Capsule { a: a + translation, b: b + translation, radius }
            }
            Self::Bounds { min, max } => {
                Self::Bounds { min: min + translation, max: max + translation }
            }
            Self::Mesh { center, rotation, distance } => {
                let rotation = turned(rotation, turn);
                Self::Mesh { center: center + translation, rotation, distance }
            }
        }
    }

    /// Rotation of its own axes.
    pub(crate) fn axes(&self) -> Quat {
        match *self {
            Self::Box { rotation, .. } | Self::Mesh { rotation, .. } => rotation,
            Self::Plane { .. }
            | Self::Sphere { .. }
            | Self::Capsule { .. }
            | Self::Bounds { .. } => Quat::IDENTITY,
        }
    }

    /// The point about which it rotates; for a plane, the point nearest to the origin.
    pub(crate) fn center(&self) -> Vec3 {
        match *self {
            Self::Plane { normal, offset } => normal * offset,
            Self::Box { center, .. } | Self::Sphere { center, .. } | Self::Mesh { center, .. } => {
                center
            }
            Self::Capsule { a, b, .. } => (a + b) * 0.5,
            Self::Bounds { min, max } => (min + max) * 0.5,
        }
    }
}

/// Normalises a quaternion x, y, z, w other than 0.
fn unit(rotation: [f32; 4]) -> Quat {
    Frame::from_pose(&Pose { translation: [0.0; 3], rotation }).rotation
}

/// Turns a rotation. One that does not turn keeps every bit.
fn turned(rotation: Quat, turn: Quat) -> Quat {
    if turn == Quat::IDENTITY { rotation } else { (turn * rotation).normalize() }
}
