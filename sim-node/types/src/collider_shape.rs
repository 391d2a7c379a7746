//! The shapes of colliders, and a collider of any shape as plain numbers.

use crate::names::names;

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

/// Shape, size and pose of a collider, with the fields of all shapes. Those that the shape does not use are 0.
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
