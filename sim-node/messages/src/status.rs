//! The messages of the service `status`.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::limits::MEMBERS_MAX;
use crate::lockstep::MemberChanges;

/// Status of a node or replay: 1376 bytes, alignment 8. Written by the owner of the name at 10 Hz, and at
/// once after a change of the members, before the step that follows it. Percentiles cover the steps of the last second.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.NodeStatus")]
pub struct NodeStatus {
    /// [`crate::CONTRACT_VERSION`] of the writer.
    pub contract_version: u32,
    /// Same as in [`crate::SnapshotHeader`].
    pub solver_version: u32,
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Last performed step.
    pub step: u64,
    /// Simulated time per wall-clock time over the last second; 0 while paused.
    pub real_time_factor: f64,
    /// Requested pace: simulated time per wall-clock time; 1 is real time.
    pub time_scale: f64,
    /// Delay of wake-ups after their deadlines, median, in nanoseconds.
    pub wake_late_ns_p50: u64,
    /// Delay of wake-ups after their deadlines, 99th percentile, in nanoseconds.
    pub wake_late_ns_p99: u64,
    /// Time of the solver for a step, median, in nanoseconds.
    pub solve_ns_p50: u64,
    /// Time of the solver for a step, 99th percentile, in nanoseconds.
    pub solve_ns_p99: u64,
    /// Number of steps of this run that began more than a period after their deadline.
    pub late_steps: u64,
    /// Number of periods of this run that the node skipped because it was too far behind.
    pub skipped_periods: u64,
    /// Number of outcomes of this run.
    pub outcome_count: u64,
    /// Number of rejected commands of this run, and of refused messages of the service `ready`.
    pub rejected_count: u64,
    /// Number of frozen particles, whose state was not finite.
    pub frozen_count: u64,
    /// Number of steps in which a body stood, because no `drive_body` came for it after the first; of the scene since
    /// its load.
    pub standing_body_steps: u64,
    /// Steps per second.
    pub rate_hz: u32,
    /// Number of particles in the scene.
    pub particle_count: u32,
    /// Number of constraints in the scene.
    pub constraint_count: u32,
    /// Number of torn constraints.
    pub torn_count: u32,
    /// Number of readers of `particles`.
    pub reader_count: u32,
    /// Process id of the writer.
    pub process_id: u32,
    /// [`StatusFlags`] bits.
    pub flags: u32,
    /// Number of members of the lockstep.
    pub member_count: u32,
    /// Name of the scene in UTF-8, cut at 64 bytes, padded with zeros.
    pub scene_name: [u8; 64],
    /// The members of the lockstep in the order of joining; entries beyond `member_count` are 0.
    pub members: [MemberStatus; MEMBERS_MAX],
    /// The changes of the members in this run.
    pub member_changes: MemberChanges,
}

const _: () = assert!(size_of::<NodeStatus>() == 1376 && align_of::<NodeStatus>() == 8);

/// A member of the lockstep: 24 bytes, alignment 8.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.MemberStatus")]
pub struct MemberStatus {
    /// Client id of the member.
    pub client_id: u64,
    /// Last step that the member was ready for; the step of its joining if there is none.
    pub step: u64,
    /// Distance of the member's turns, in steps: a turn is at the first published step that is this distance or more
    /// after the last turn.
    pub every: u32,
    /// 1 if the node waits for this member, otherwise 0.
    pub is_awaited: u32,
}

const _: () = assert!(size_of::<MemberStatus>() == 24 && align_of::<MemberStatus>() == 8);

impl Default for NodeStatus {
    fn default() -> Self {
        Self::zeroed()
    }
}

/// The bits of [`NodeStatus::flags`]; all others are 0.
#[derive(Debug)]
pub struct StatusFlags;

impl StatusFlags {
    /// The node waits for `resume` or `step`.
    pub const PAUSED: u32 = 1;
    /// The writer plays a recording; it is not a live node.
    pub const REPLAY: u32 = 1 << 1;
    /// A replay has published the last snapshot of its run. It goes on only with another run, as after a
    /// rewind.
    pub const AT_END: u32 = 1 << 2;
}

impl NodeStatus {
    /// Sets the scene's name. A longer name is cut to whole characters within 64 bytes.
    pub fn set_scene_name(&mut self, name: &str) {
        let length = name.floor_char_boundary(self.scene_name.len());
        self.scene_name = [0; 64];
        self.scene_name[..length].copy_from_slice(&name.as_bytes()[..length]);
    }

    /// Returns the scene's name. Bytes that are not UTF-8 become replacement characters.
    pub fn scene_name(&self) -> String {
        let length = self.scene_name.iter().position(|byte| *byte == 0).unwrap_or(64);
        String::from_utf8_lossy(&self.scene_name[..length]).into_owned()
    }

    /// Returns the members of the lockstep, in the order of joining.
    pub fn members(&self) -> &[MemberStatus] {
        &self.members[..(self.member_count as usize).min(MEMBERS_MAX)]
    }

    /// Returns `true` if the node waits for `resume` or `step`.
    pub fn is_paused(&self) -> bool {
        self.flags & StatusFlags::PAUSED != 0
    }

    /// Returns `true` if the writer plays a recording.
    pub fn is_replay(&self) -> bool {
        self.flags & StatusFlags::REPLAY != 0
    }

    /// Returns `true` if a replay has published the last snapshot of its run.
    pub fn is_at_end(&self) -> bool {
        self.flags & StatusFlags::AT_END != 0
    }
}
