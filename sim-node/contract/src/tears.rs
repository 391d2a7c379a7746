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

/// Why a constraint tore; the bytes of `tear_causes`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum TearCause {
    /// Its force exceeded `tear_force`.
    Force = 0,
    /// Its length exceeded `tear_stretch` rest lengths.
    Stretch = 1,
    /// Its length exceeded the rest length by more than `tear_distance`.
    Distance = 2,
    /// A command cut it.
    Cut = 3,
}

const TEAR_CAUSES: [(TearCause, &str); 4] = [
    (TearCause::Force, "force"),
    (TearCause::Stretch, "stretch"),
    (TearCause::Distance, "distance"),
    (TearCause::Cut, "cut"),
];

impl TearCause {
    /// The cause of that number; none for one of another version, or where it is not known.
    pub fn from_number(number: u8) -> Option<Self> {
        TEAR_CAUSES.get(usize::from(number)).map(|(cause, _)| *cause)
    }

    /// The cause of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        TEAR_CAUSES.iter().find(|(_, known)| *known == name).map(|(cause, _)| *cause)
    }

    /// Its word in logs.
    pub fn name(self) -> &'static str {
        TEAR_CAUSES[self as usize].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_one_name_and_one_number() {
        for (cause, name) in TEAR_CAUSES {
            assert_eq!(TearCause::from_number(cause as u8), Some(cause));
            assert_eq!((TearCause::from_name(name), cause.name()), (Some(cause), name));
        }
        assert_eq!(TearCause::from_number(4), None);
    }
}
