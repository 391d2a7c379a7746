//! What a node publishes once per load, and as keyframes.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// One constraint: 20 bytes, alignment 4. Its place in `topology` is its index everywhere.
/// Does not change from load to load; what is torn comes by the tears service.
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

/// Three particle indices of one triangle of the surface: 12 bytes, alignment 4.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Triangle")]
pub struct Triangle {
    /// The corners, counter-clockwise seen from the front.
    pub corners: [u32; 3],
}

const _: () = assert!(size_of::<Triangle>() == 12 && align_of::<Triangle>() == 4);

/// The header of `topology`, `surface` and `scene`: 64 bytes, alignment 8.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.LoadHeader")]
pub struct LoadHeader {
    /// As in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// The first step that shows this load.
    pub step: u64,
    /// What positions are relative to, in the scene's unit.
    pub origin: [f64; 3],
    /// As in [`crate::SnapshotHeader`].
    pub topology_revision: u32,
    /// Elements of the payload: constraints, triangles or bytes.
    pub count: u32,
    /// Particles of the scene.
    pub particle_count: u32,
    /// Steps per second.
    pub rate_hz: u32,
    /// A [`Method`](crate::Method) as a number.
    pub method: u32,
    /// Always 0.
    pub spare: u32,
}

const _: () = assert!(size_of::<LoadHeader>() == 64 && align_of::<LoadHeader>() == 8);

/// The header of `keyframe`: 24 bytes, alignment 8.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.KeyframeHeader")]
pub struct KeyframeHeader {
    /// As in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// The published snapshot that this completes.
    pub step: u64,
    /// Length of the payload in bytes.
    pub size_bytes: u64,
}

const _: () = assert!(size_of::<KeyframeHeader>() == 24 && align_of::<KeyframeHeader>() == 8);
