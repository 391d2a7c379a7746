//! The messages of the service `particles`.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// State of a particle after a step: 32 bytes, alignment 4; an element of `particles`. The position
/// in the payload is the particle's index everywhere.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.ParticleState")]
pub struct ParticleState {
    /// Position relative to the scene's origin, in the scene's unit (m).
    pub position: [f32; 3],
    /// 1/mass in 1/kg, as used by the step: 0 for pinned, grabbed, anchored and frozen particles.
    pub inverse_mass: f32,
    /// Velocity in m/s; 0 for pinned and frozen particles.
    pub velocity: [f32; 3],
    /// [`ParticleFlags`](crate::ParticleFlags) bits.
    pub flags: u32,
}

const _: () = assert!(size_of::<ParticleState>() == 32 && align_of::<ParticleState>() == 4);

/// Header of `particles`: 112 bytes, alignment 8. Written by the node or a replay. The snapshot and
/// the keyframe of a step are together the complete state of the solver after that step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.SnapshotHeader")]
pub struct SnapshotHeader {
    /// [`crate::CONTRACT_VERSION`] of the writer.
    pub contract_version: u32,
    /// Version of the solver's arithmetic. It changes with any change of the bits of a state.
    pub solver_version: u32,
    /// Random number of this run of the node, or of this pass of a replay.
    pub run_id: u64,
    /// Number of the step whose end this state is; 0 is the scene as loaded. Within a run it never
    /// goes back and skips no step, although a reader may miss snapshots.
    pub step: u64,
    /// Steps since the scene was last loaded, reset or restored.
    pub scene_step: u64,
    /// Step of the newest published keyframe.
    pub keyframe_step: u64,
    /// step / rate in nanoseconds, rounded down.
    pub sim_time_ns: u64,
    /// Time of publication: CLOCK_MONOTONIC in nanoseconds.
    pub publish_monotonic_ns: u64,
    /// XXH3-64 of the payload. The seed is 0 while nothing is torn, else the XXH3-64 of the torn
    /// constraints' indices, ascending, as little-endian u32.
    pub state_hash: u64,
    /// Number of outcomes in this run so far. Outcomes with a lower index are part of this state.
    pub outcome_count: u64,
    /// Delay of the step's start after its deadline, in nanoseconds.
    pub wake_late_ns: u64,
    /// Time that the solver took for this step, in nanoseconds.
    pub solve_ns: u64,
    /// Number of the load in this run. Topology, surface and scene of the load carry the same number.
    pub topology_revision: u32,
    /// Number of torn constraints.
    pub torn_count: u32,
    /// Length of the payload.
    pub particle_count: u32,
    /// [`SnapshotFlags`] bits.
    pub flags: u32,
    /// Number of steps from one published snapshot to the next: 1, unless the node runs with
    /// `--every`. A node that pauses also publishes the step before the pause. In a replay, the distance
    /// from the snapshot before.
    pub stride: u32,
    /// Number of snapshots that the run has published before this one, modulo 2^32. A reader that finds
    /// a number left out has missed that snapshot, whatever the steps between them.
    pub snapshot_index: u32,
}

const _: () = assert!(size_of::<SnapshotHeader>() == 112 && align_of::<SnapshotHeader>() == 8);

/// The bits of [`SnapshotHeader::flags`]; all others are 0.
#[derive(Debug)]
pub struct SnapshotFlags;

impl SnapshotFlags {
    /// The node was paused when it performed this step, for a `step` or `reset` command.
    pub const PAUSED: u32 = 1;
    /// The writer plays a recording; it is not a live node.
    pub const REPLAY: u32 = 1 << 1;
    /// A `load`, `reset`, `rewind` or `restore` command has put this state in place: nothing was integrated in
    /// this step. It is a turn of every member of the lockstep. Not set in step 0 of a run, nor in a replay.
    pub const IN_PLACE: u32 = 1 << 2;
}
