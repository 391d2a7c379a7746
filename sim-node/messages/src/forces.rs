//! The messages of the service `forces`.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// Header of `forces`: 24 bytes, alignment 8. The payload has a row for each collider, then for each anchor,
/// then for each pinned, grabbed or anchored particle, each by index.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ForcesHeader")]
pub struct ForcesHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Step in which the impulses acted.
    pub step: u64,
    /// Length of the payload.
    pub count: u32,
    /// Steps per second: a force is an impulse times this rate.
    pub rate_hz: u32,
}

const _: () = assert!(size_of::<ForcesHeader>() == 24 && align_of::<ForcesHeader>() == 8);

/// The impulse of a step on a collider, an anchor or a particle: 40 bytes, alignment 4; an element of `forces`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ForceRow")]
pub struct ForceRow {
    /// A [`ForceKind`] as a number.
    pub kind: u32,
    /// Index of the collider, anchor or particle.
    pub index: u32,
    /// On a collider, that of the particles in contact with it; on a particle, that of its constraints, bends
    /// and tethers; on an anchor, the sum of those of its particles. In N s.
    pub impulse: [f32; 3],
    /// About the center of the collider or anchor, in N m s. 0 for a particle.
    pub angular_impulse: [f32; 3],
    /// Largest number of particles in contact with the collider in one substep; else 0.
    pub contacts: u32,
    /// Always 0.
    pub spare: u32,
}

const _: () = assert!(size_of::<ForceRow>() == 40 && align_of::<ForceRow>() == 4);

impl ForceRow {
    /// Returns the kind of the row; `None` for a number of another version.
    pub fn kind(&self) -> Option<ForceKind> {
        ForceKind::ALL.get(self.kind as usize).copied()
    }
}

/// Recipient of an impulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ForceKind {
    /// A collider.
    Collider = 0,
    /// An anchor.
    Anchor = 1,
    /// A pinned, grabbed or anchored particle.
    Particle = 2,
}

impl ForceKind {
    /// All kinds, by number.
    pub const ALL: [Self; 3] = [Self::Collider, Self::Anchor, Self::Particle];

    /// Returns the name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Collider => "collider",
            Self::Anchor => "anchor",
            Self::Particle => "particle",
        }
    }
}
