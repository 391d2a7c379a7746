//! The messages of the service `tears`.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use sim_types::TearCause;

/// Header of `tears`: 32 bytes, alignment 8. The payload lists every torn constraint,
/// in the order of tearing. A list repeats the lists before it, so a reader that
/// misses a message loses nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.TearsHeader")]
pub struct TearsHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Step of the newest tear, or of the load, reset, rewind or restore that replaced the list.
    pub step: u64,
    /// Step of the load, reset, rewind or restore that the list begins with. Lists with the same `since_step`
    /// continue each other.
    pub since_step: u64,
    /// Number of constraints at the end of the payload that tore in this step.
    pub new_count: u32,
    /// Length of the payload.
    pub count: u32,
}

const _: () = assert!(size_of::<TearsHeader>() == 32 && align_of::<TearsHeader>() == 8);

/// A torn constraint: 8 bytes, alignment 4; an element of `tears`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.TornConstraint")]
pub struct TornConstraint {
    /// Index of the constraint.
    pub constraint: u32,
    /// A [`TearCause`] as a number; `u32::MAX` where the cause is unknown, as in the replay of an
    /// old recording.
    pub cause: u32,
}

const _: () = assert!(size_of::<TornConstraint>() == 8 && align_of::<TornConstraint>() == 4);

impl TornConstraint {
    /// Creates an element for a constraint and the cause of its tear; `None` is an unknown cause.
    pub fn new(constraint: u32, cause: Option<TearCause>) -> Self {
        Self { constraint, cause: cause.map_or(u32::MAX, |cause| cause as u32) }
    }

    /// Returns the cause of the tear, if it is known.
    pub fn cause(&self) -> Option<TearCause> {
        TearCause::from_number(self.cause)
    }
}
