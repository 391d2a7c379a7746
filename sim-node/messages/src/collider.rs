//! The messages of the service `colliders`.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use sim_types::ColliderFields;

/// A collider in its pose at the end of a step: 120 bytes, alignment 4. Its position in `colliders`
/// is its index everywhere. Fields that a shape does not use are 0. Lengths are in m, relative to
/// the scene's origin; velocities are in m/s.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ColliderState")]
pub struct ColliderState {
    /// A [`ColliderShape`](crate::ColliderShape) as a number.
    pub shape: u32,
    /// Ratio of the rebound speed to the approach speed, 0..=1.
    pub restitution: f32,
    /// Coefficient of friction.
    pub friction: f32,
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
    /// Velocity of the collider.
    pub velocity: [f32; 3],
    /// Angular velocity of a box or mesh about its center, in rad/s.
    pub angular_velocity: [f32; 3],
}

const _: () = assert!(size_of::<ColliderState>() == 120 && align_of::<ColliderState>() == 4);

impl From<ColliderFields> for ColliderState {
    /// At rest, without restitution and friction.
    fn from(fields: ColliderFields) -> Self {
        let ColliderFields { shape, radius, offset, normal, center, half_extents, rotation, a, b } =
            fields;
        let shape = shape as u32;
        Self {
            shape,
            radius,
            offset,
            normal,
            center,
            half_extents,
            rotation,
            a,
            b,
            ..Self::default()
        }
    }
}

/// Header of `colliders`: 24 bytes, alignment 8. Written per load, on a change, and each step while
/// a collider moves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.CollidersHeader")]
pub struct CollidersHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Step at whose end the colliders had these poses.
    pub step: u64,
    /// Length of the payload.
    pub count: u32,
    /// Number of lists that the run has published before this one, modulo 2^32. A reader that finds a
    /// number left out has missed that list.
    pub list_index: u32,
}

const _: () = assert!(size_of::<CollidersHeader>() == 24 && align_of::<CollidersHeader>() == 8);
