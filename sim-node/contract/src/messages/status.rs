//! How a node is doing, ten times a second.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// State of a node or replay: 208 bytes, alignment 8. Written by the owner of the name at 10 Hz.
/// Percentiles are over the steps of the last second.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.NodeStatus")]
pub struct NodeStatus {
    /// [`crate::CONTRACT_VERSION`] of the writer.
    pub contract_version: u32,
    /// As in [`crate::SnapshotHeader`].
    pub solver_version: u32,
    /// As in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// The last step that was made.
    pub step: u64,
    /// Simulated time made per wall-clock time over the last second; 0 while paused.
    pub real_time_factor: f64,
    /// The pace that is asked for: simulated time per wall-clock time, 1 for real time.
    pub time_scale: f64,
    /// Lateness of wake-ups after their deadlines, median, in nanoseconds.
    pub wake_late_ns_p50: u64,
    /// The same, 99th percentile.
    pub wake_late_ns_p99: u64,
    /// Time of the solver for a step, median, in nanoseconds.
    pub solve_ns_p50: u64,
    /// The same, 99th percentile.
    pub solve_ns_p99: u64,
    /// Steps of this run that began more than a period after their deadline.
    pub late_steps: u64,
    /// Periods of this run that were given up because the node was too far behind.
    pub skipped_periods: u64,
    /// Outcomes of this run.
    pub outcome_count: u64,
    /// Rejected commands of this run.
    pub rejected_count: u64,
    /// Particles that were frozen since the load because their state was no longer finite.
    pub frozen_count: u64,
    /// Steps per second.
    pub rate_hz: u32,
    /// Particles of the scene.
    pub particle_count: u32,
    /// Constraints of the scene.
    pub constraint_count: u32,
    /// Constraints torn since the load.
    pub torn_count: u32,
    /// Readers of `particles`.
    pub reader_count: u32,
    /// Process id of the writer.
    pub process_id: u32,
    /// [`StatusFlags`] bits.
    pub flags: u32,
    /// Always 0.
    pub spare: u32,
    /// Name of the scene in UTF-8, cut at 64 bytes, zeros behind it.
    pub scene_name: [u8; 64],
}

const _: () = assert!(size_of::<NodeStatus>() == 208 && align_of::<NodeStatus>() == 8);

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
    /// A recording is being played; this is not a live node.
    pub const REPLAY: u32 = 1 << 1;
}

impl NodeStatus {
    /// Sets the scene's name, cut at a character within 64 bytes.
    pub fn set_scene_name(&mut self, name: &str) {
        let length = name.floor_char_boundary(self.scene_name.len());
        self.scene_name = [0; 64];
        self.scene_name[..length].copy_from_slice(&name.as_bytes()[..length]);
    }

    /// The scene's name; what is not UTF-8 shows as replacement characters.
    pub fn scene_name(&self) -> String {
        let length = self.scene_name.iter().position(|byte| *byte == 0).unwrap_or(64);
        String::from_utf8_lossy(&self.scene_name[..length]).into_owned()
    }

    /// Whether the node waits for `resume` or `step`.
    pub fn is_paused(&self) -> bool {
        self.flags & StatusFlags::PAUSED != 0
    }
}
