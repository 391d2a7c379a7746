//! The messages of the services `topology`, `bends`, `surface`, `scene` and `keyframe`.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

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

/// A bend: 52 bytes, alignment 4; an element of `bends`. Its position there is its index. It does not
/// change until the next load, and never tears; it stops acting once a constraint of its path is torn.
///
/// With C the sum of c x over its particles, its energy in J is |C - rest n|^2 / (2 alpha), where
/// alpha = `geometry` / rigidity is its compliance in m/N. For the positions p0 to p3 of a hinge, n is the unit
/// vector along the sum of the unit normals of its triangles, along (p2 - p1) x (p0 - p1) and
/// (p3 - p1) x (p2 - p1). `set bending` replaces the rigidity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.BendState")]
pub struct BendState {
    /// Indices of the particles. The fourth of a bend of three is its second one again.
    pub particles: [u32; 4],
    /// Coefficients c of the particles; their sum is 0. The fourth of a bend of three is 0.
    pub coefficients: [f32; 4],
    /// Compliance times rigidity: m^2 on a surface, m^3 on a line.
    pub geometry: f32,
    /// Bending rigidity of the scene: N m on a surface, N m^2 on a line.
    pub rigidity: f32,
    /// C along n at rest, in m. Other than 0 only for a hinge that is folded at rest.
    pub rest: f32,
    /// 0 three particles on a line, 1 the corners of a cell, which it keeps from twisting, 2 a hinge: a third
    /// corner, the ends of the edge, and the other third corner of two triangles.
    pub shape: u32,
    /// Index of the `[[generate]]` block that it comes from; -1 for an explicit bend, because 0 is a block.
    pub block: i32,
}

const _: () = assert!(size_of::<BendState>() == 52 && align_of::<BendState>() == 4);

/// A triangle of the surface: 12 bytes, alignment 4; an element of `surface`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Triangle")]
pub struct Triangle {
    /// Particle indices of the corners, counter-clockwise as seen from the front.
    pub corners: [u32; 3],
}

const _: () = assert!(size_of::<Triangle>() == 12 && align_of::<Triangle>() == 4);

/// Header of `topology`, `bends`, `surface` and `scene`: 72 bytes, alignment 8. Written once per load.
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
    /// Length of the payload in constraints, bends, triangles or bytes.
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

/// Header of `keyframe`: 40 bytes, alignment 8.
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
    /// Number of outcomes of the run up to this state. Those after the snapshot's, such as that of a pause, have not
    /// changed it. 0 in a replay, where the snapshot counts all.
    pub outcome_count: u64,
    /// Number of outcomes of the run that precede this message, or follow it at once. A node publishes a keyframe again
    /// before the first outcome that `outcome_count` does not count. A reader that receives only that message has
    /// joined too late for all outcomes after the state. 0 in a replay.
    pub published_outcome_count: u64,
}

const _: () = assert!(size_of::<KeyframeHeader>() == 40 && align_of::<KeyframeHeader>() == 8);

impl KeyframeHeader {
    /// Returns `true` if a reader that has received this message receives every outcome after the state.
    pub fn precedes_outcomes(&self) -> bool {
        self.published_outcome_count <= self.outcome_count
    }
}
