//! The kinds of constraints, colliders and tears, the methods, and the flags of particles.

use serde::{Deserialize, Serialize};

use crate::names::names;

/// The role of a constraint in its scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum ConstraintKind {
    /// Joins direct neighbours.
    #[default]
    Structural = 0,
    /// Crosses a cell diagonally.
    Shear = 1,
    /// Joins second neighbours.
    Bend = 2,
    /// Acts only while it is longer than its rest length.
    Tether = 3,
}

names!(ConstraintKind: Structural = "structural", Shear = "shear", Bend = "bend", Tether = "tether");

/// Method of solving constraints. It determines the meaning of a constraint's softness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum Method {
    /// XPBD, with compliance in m/N: the stretch is the same at every rate (Macklin, Mueller, Chentanez
    /// 2016).
    #[default]
    Xpbd = 0,
    /// PBD, with stiffness 0..=1: the share of the error that the iterations of a substep remove
    /// (Mueller et al. 2007).
    Pbd = 1,
}

names!(Method: Xpbd = "xpbd", Pbd = "pbd");

/// Cause of a tear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u32)]
pub enum TearCause {
    /// The constraint's force exceeded `tear_force`.
    Force = 0,
    /// The constraint's length exceeded `tear_stretch` times its rest length.
    Stretch = 1,
    /// The constraint's length exceeded its rest length by more than `tear_distance`.
    Distance = 2,
    /// A command cut the constraint.
    Cut = 3,
}

names!(TearCause: Force = "force", Stretch = "stretch", Distance = "distance", Cut = "cut");

/// Shape of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ColliderShape {
    /// A solid half space.
    Plane = 0,
    /// A solid box.
    Box = 1,
    /// A solid sphere.
    Sphere = 2,
    /// All points within a radius of a segment.
    Capsule = 3,
    /// A box that particles stay inside.
    Bounds = 4,
    /// Triangles with two sides.
    Mesh = 5,
}

names! {
    ColliderShape:
    Plane = "plane",
    Box = "box",
    Sphere = "sphere",
    Capsule = "capsule",
    Bounds = "bounds",
    Mesh = "mesh",
}

/// Shape, size and pose of a collider, with the fields of all shapes. Fields that the shape does not use are 0.
/// Lengths are in the unit of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColliderFields {
    /// The shape.
    pub shape: ColliderShape,
    /// Radius of a sphere or capsule; distance that particles keep from a mesh.
    pub radius: f32,
    /// Offset of a plane: the side where `normal` · x >= `offset` is free.
    pub offset: f32,
    /// Unit normal of a plane; points to the free side.
    pub normal: [f32; 3],
    /// Center of a box, sphere or mesh.
    pub center: [f32; 3],
    /// Half the edge lengths of a box, along its own axes.
    pub half_extents: [f32; 3],
    /// Rotation of a box or mesh, as the quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// First end of a capsule's axis; the lowest corner of bounds.
    pub a: [f32; 3],
    /// Second end of a capsule's axis; the highest corner of bounds.
    pub b: [f32; 3],
}

impl ColliderFields {
    /// Creates the fields of a shape, all 0.
    pub const fn new(shape: ColliderShape) -> Self {
        Self {
            shape,
            radius: 0.0,
            offset: 0.0,
            normal: [0.0; 3],
            center: [0.0; 3],
            half_extents: [0.0; 3],
            rotation: [0.0; 4],
            a: [0.0; 3],
            b: [0.0; 3],
        }
    }
}

/// Bits of a particle's `flags`; all other bits are 0.
#[derive(Debug)]
pub struct ParticleFlags;

impl ParticleFlags {
    /// Held in place.
    pub const PINNED: u32 = 1;
    /// Moved to a client's target.
    pub const GRABBED: u32 = 1 << 1;
    /// Moved by an anchor.
    pub const ANCHORED: u32 = 1 << 2;
    /// Excluded from the simulation because its state was not finite.
    pub const FROZEN: u32 = 1 << 3;
    /// All flags. A particle with any of them has inverse mass 0 in the step.
    pub const ALL: u32 = Self::PINNED | Self::GRABBED | Self::ANCHORED | Self::FROZEN;

    /// Name of each flag, by ascending bit.
    pub const NAMES: [(u32, &'static str); 4] = [
        (Self::PINNED, "pinned"),
        (Self::GRABBED, "grabbed"),
        (Self::ANCHORED, "anchored"),
        (Self::FROZEN, "frozen"),
    ];
}
