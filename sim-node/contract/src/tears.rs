//! What tore, and why.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// The header of `tears`, whose payload is all constraints torn since the load, in the order of
/// tearing, and of `tear_causes`, whose payload is why each of them tore: 24 bytes, alignment 8.
/// The causes are published first, under an equal header.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.TearsHeader")]
pub struct TearsHeader {
    /// As in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// The step that the newest of them tore in.
    pub step: u64,
    /// How many at the end of the payload are new in that step.
    pub new_count: u32,
    /// Length of the payload.
    pub count: u32,
}

const _: () = assert!(size_of::<TearsHeader>() == 24 && align_of::<TearsHeader>() == 8);
