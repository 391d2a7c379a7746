//! The messages of the services `topology`, `surface`, `scene` and `keyframe`.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// A constraint: 20 bytes, alignment 4. Its position in `topology` is its index everywhere. It does
/// not change until the next load; the service `tears` lists the torn constraints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ConstraintState")]
pub struct ConstraintState {
    /// Index of the first particle.
    pub a: u32,
    /// Index of the second particle.
    pub b: u32,
    /// Rest length in m.
    pub rest_length: f32,
    /// Compliance in m/N (method xpbd) or stiffness 0..=1 (method pbd).
    pub compliance: f32,
    /// A [`ConstraintKind`](crate::ConstraintKind) as a number.
    pub kind: u32,
}

const _: () = assert!(size_of::<ConstraintState>() == 20 && align_of::<ConstraintState>() == 4);

/// A triangle of the surface: 12 bytes, alignment 4; an element of `surface`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Triangle")]
pub struct Triangle {
    /// Particle indices of the corners, counter-clockwise as seen from the front.
    pub corners: [u32; 3],
}

const _: () = assert!(size_of::<Triangle>() == 12 && align_of::<Triangle>() == 4);

/// Header of `topology`, `surface` and `scene`: 72 bytes, alignment 8. Written once per load.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.LoadHeader")]
pub struct LoadHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// First step that shows this load.
    pub step: u64,
    /// Hash of the scene's text; see [`crate::scene_hash`]. Set by the owner.
    pub scene_hash: u64,
    /// Origin of all positions, in the scene's unit (m).
    pub origin: [f64; 3],
    /// Same as in [`crate::SnapshotHeader`].
    pub topology_revision: u32,
    /// Length of the payload in constraints, triangles or bytes.
    pub count: u32,
    /// Number of particles in the scene.
    pub particle_count: u32,
    /// Steps per second.
    pub rate_hz: u32,
    /// A [`Method`](crate::Method) as a number.
    pub method: u32,
    /// Always 0.
    pub spare: u32,
}

const _: () = assert!(size_of::<LoadHeader>() == 72 && align_of::<LoadHeader>() == 8);

/// Header of `keyframe`: 24 bytes, alignment 8.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.KeyframeHeader")]
pub struct KeyframeHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Step of the published snapshot that the keyframe completes.
    pub step: u64,
    /// Length of the payload in bytes.
    pub size_bytes: u64,
}

const _: () = assert!(size_of::<KeyframeHeader>() == 24 && align_of::<KeyframeHeader>() == 8);
