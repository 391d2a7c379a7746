//! The messages of the service `ready`.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use sim_types::CLIENT_ID_END;

/// Message of a member of the lockstep: 32 bytes, alignment 8. It is not a command: it changes no
/// state, and has no outcome. The connection that it comes through identifies the member.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.Ready")]
pub struct Ready {
    /// Client id of the member, below [`CLIENT_ID_END`].
    pub client_id: u64,
    /// Run of the step; 0 if the member joins and has read no snapshot.
    pub run_id: u64,
    /// The node may compute the step after this one: the member has sent its commands for it.
    pub step: u64,
    /// Distance of the member's turns, in steps, at least 1: a turn is at the first published step that is this distance or more
    /// after the last turn.
    pub every: u32,
    /// [`Ready::TAG`] or [`Ready::REPEAT_TAG`]. Anything else is refused.
    pub tag: u32,
}

const _: () = assert!(size_of::<Ready>() == 32 && align_of::<Ready>() == 8);

impl Ready {
    /// Marks a message of this service. Random bytes are unlikely to contain it.
    pub const TAG: u32 = u32::from_le_bytes(*b"redy");
    /// Marks a request: the owner shall publish the latched messages again, because a tunnel gives its
    /// late readers none. It joins nothing, and the other fields do not matter.
    pub const REPEAT_TAG: u32 = u32::from_le_bytes(*b"rept");

    /// Returns `true` if the message is one of this service.
    pub fn is_valid(&self) -> bool {
        self.tag == Self::TAG && self.every > 0 && self.client_id < CLIENT_ID_END
    }
}
