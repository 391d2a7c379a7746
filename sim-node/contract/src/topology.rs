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
    /// A [`ConstraintKind`] as a number.
    pub kind: u32,
}

const _: () = assert!(size_of::<ConstraintState>() == 20 && align_of::<ConstraintState>() == 4);

/// What a constraint is for; the values of [`ConstraintState::kind`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ConstraintKind {
    /// Between direct neighbours.
    Structural = 0,
    /// Across a diagonal.
    Shear = 1,
    /// Between next neighbours but one.
    Bend = 2,
    /// Acts only when longer than its rest length.
    Tether = 3,
}

const CONSTRAINT_KINDS: [(ConstraintKind, &str); 4] = [
    (ConstraintKind::Structural, "structural"),
    (ConstraintKind::Shear, "shear"),
    (ConstraintKind::Bend, "bend"),
    (ConstraintKind::Tether, "tether"),
];

impl ConstraintKind {
    /// The kind of that number, if there is one.
    pub fn from_number(number: u32) -> Option<Self> {
        CONSTRAINT_KINDS.get(number as usize).map(|(kind, _)| *kind)
    }

    /// The kind of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        CONSTRAINT_KINDS.iter().find(|(_, known)| *known == name).map(|(kind, _)| *kind)
    }

    /// Its word in scenes, commands and logs.
    pub fn name(self) -> &'static str {
        CONSTRAINT_KINDS[self as usize].1
    }
}

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
    /// 0 xpbd (constraints have a compliance), 1 pbd (they have a stiffness).
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_constraint_has_one_name_and_one_number() {
        for (kind, name) in CONSTRAINT_KINDS {
            assert_eq!(ConstraintKind::from_number(kind as u32), Some(kind));
            assert_eq!((ConstraintKind::from_name(name), kind.name()), (Some(kind), name));
        }
        assert_eq!(ConstraintKind::from_number(4), None);
        assert_eq!(ConstraintKind::from_name("knot"), None);
    }
}
