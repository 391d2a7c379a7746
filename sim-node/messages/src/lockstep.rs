//! The lockstep: the messages of its members on the service `ready`, and the part of the status that tells who
//! joined it, who left it, and why.

use std::fmt;

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use sim_types::CLIENT_ID_END;

use crate::limits::MEMBER_CHANGES_KEPT;

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

/// The changes of the members of the lockstep in a run: 776 bytes, alignment 8. It holds the last
/// [`MEMBER_CHANGES_KEPT`] of them, so that a reader that misses statuses still receives every change, or
/// knows how many it has missed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.MemberChanges")]
pub struct MemberChanges {
    /// Number of changes since the start of the run.
    pub count: u64,
    /// The last changes: the one with number `n`, from 0, is entry `n` modulo [`MEMBER_CHANGES_KEPT`].
    pub last: [MemberChange; MEMBER_CHANGES_KEPT],
}

const _: () = assert!(size_of::<MemberChanges>() == 776 && align_of::<MemberChanges>() == 8);

/// A change of the members of the lockstep: 24 bytes, alignment 8.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.MemberChange")]
pub struct MemberChange {
    /// Client id of the member.
    pub client_id: u64,
    /// Last step that was computed before the change.
    pub step: u64,
    /// Distance of the member's turns, in steps, as in [`crate::MemberStatus`].
    pub every: u32,
    /// A [`MemberChangeKind`] as a number.
    pub kind: u32,
}

const _: () = assert!(size_of::<MemberChange>() == 24 && align_of::<MemberChange>() == 8);

/// Kind of a change of the members, with the reason why a member was removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum MemberChangeKind {
    /// It has joined.
    Joined = 0,
    /// It has closed its connection. So has a killed one, if another process cleaned up after it before the
    /// node looked.
    Left = 1,
    /// Its process ended without closing the connection.
    Killed = 2,
    /// It was not ready within the longest wait of the node.
    TimedOut = 3,
}

impl MemberChangeKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Joined, Self::Left, Self::Killed, Self::TimedOut];

    /// Returns the kind with a number; `None` for a number that this version does not know.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| *kind as u32 == number)
    }

    /// Returns the name of the kind, as in the `/events` of a recording.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joined => "joined",
            Self::Left => "left",
            Self::Killed => "killed",
            Self::TimedOut => "timed_out",
        }
    }
}

impl MemberChange {
    /// Returns the name of its [`MemberChangeKind`]; "unknown" for a number that this version does not know.
    pub fn kind_name(&self) -> &'static str {
        MemberChangeKind::from_number(self.kind).map_or("unknown", MemberChangeKind::name)
    }
}

impl fmt::Display for MemberChange {
    /// Describes the change in one line, without its step.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { client_id, every, .. } = *self;
        let what = match MemberChangeKind::from_number(self.kind) {
            Some(MemberChangeKind::Joined) if every > 1 => {
                return write!(
                    formatter,
                    "client {client_id} joined the lockstep for every {every} steps"
                );
            }
            Some(MemberChangeKind::Joined) => "joined the lockstep",
            Some(MemberChangeKind::Left) => "left the lockstep",
            Some(MemberChangeKind::Killed) => "was dropped from the lockstep: its process ended",
            Some(MemberChangeKind::TimedOut) => {
                "was dropped from the lockstep: it was not ready in time"
            }
            None => "changed its membership in the lockstep",
        };
        write!(formatter, "client {client_id} {what}")
    }
}

impl Default for MemberChanges {
    fn default() -> Self {
        Self::zeroed()
    }
}

impl MemberChanges {
    /// Adds a change. It replaces the oldest one if there are more than [`MEMBER_CHANGES_KEPT`].
    pub fn add(&mut self, change: MemberChange) {
        self.last[entry(self.count)] = change;
        self.count += 1;
    }

    /// Returns the changes from number `first` on, oldest first, except those before [`Self::oldest`].
    pub fn iter_from(&self, first: u64) -> impl Iterator<Item = &MemberChange> {
        (first.max(self.oldest())..self.count).map(|number| &self.last[entry(number)])
    }

    /// Returns the number of the oldest change that is held.
    pub fn oldest(&self) -> u64 {
        self.count.saturating_sub(MEMBER_CHANGES_KEPT as u64)
    }
}

/// Returns the entry of a change.
#[allow(clippy::cast_possible_truncation, reason = "it is less than the length of the array")]
fn entry(number: u64) -> usize {
    (number % MEMBER_CHANGES_KEPT as u64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_changes_are_held_and_the_others_counted() {
        let mut changes = MemberChanges::default();
        let steps = |changes: &MemberChanges, first| {
            changes.iter_from(first).map(|change| change.step).collect::<Vec<_>>()
        };
        assert!(steps(&changes, 0).is_empty());
        for step in 0..40 {
            changes.add(MemberChange { step, ..MemberChange::default() });
        }
        assert_eq!((changes.count, changes.oldest()), (40, 8));
        assert_eq!(steps(&changes, 0), (8..40).collect::<Vec<_>>());
        assert_eq!(steps(&changes, 38), [38, 39]);
        assert!(steps(&changes, 40).is_empty() && steps(&changes, u64::MAX).is_empty());
    }
}
