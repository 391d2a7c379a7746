//! What particles collide with, as readers see it.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// One collider in its pose at the end of a step: 120 bytes, alignment 4. Its place in `colliders`
/// is its index everywhere. Written on change, and each step while any of them moves; what a shape
/// does not use is 0. Lengths are in m, relative to the scene's origin, velocities in m/s.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ColliderState")]
pub struct ColliderState {
    /// A [`ColliderShape`](crate::ColliderShape) as a number.
    pub shape: u32,
    /// Part of the approach speed that is given back, 0..=1.
    pub restitution: f32,
    /// Coefficient of friction.
    pub friction: f32,
    /// Radius of a sphere or capsule.
    pub radius: f32,
    /// Of a plane: free where `normal` · x >= `offset`.
    pub offset: f32,
    /// Unit normal of a plane, towards the free side.
    pub normal: [f32; 3],
    /// Centre of a box or sphere.
    pub center: [f32; 3],
    /// Half the edges of a box, along its own axes.
    pub half_extents: [f32; 3],
    /// Rotation of a box, as the quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// One end of a capsule's axis; the least corner of bounds.
    pub a: [f32; 3],
    /// The other end of a capsule's axis; the greatest corner of bounds.
    pub b: [f32; 3],
    /// Velocity of the collider.
    pub velocity: [f32; 3],
    /// Angular velocity of a box about its centre, in rad/s.
    pub angular_velocity: [f32; 3],
}

const _: () = assert!(size_of::<ColliderState>() == 120 && align_of::<ColliderState>() == 4);

/// The header of `colliders`: 24 bytes, alignment 8.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.CollidersHeader")]
pub struct CollidersHeader {
    /// As in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// The step at whose end they stood so.
    pub step: u64,
    /// Length of the payload.
    pub count: u32,
    /// Always 0.
    pub spare: u32,
}

const _: () = assert!(size_of::<CollidersHeader>() == 24 && align_of::<CollidersHeader>() == 8);
