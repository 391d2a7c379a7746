//! The row of `/steps`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::SnapshotHeader;
use sim_solver::Energy;

/// The header of a recorded snapshot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepRow {
    /// The snapshot is the state after this step.
    pub step: u64,
    /// Steps since the scene was last loaded, reset or restored.
    pub scene_step: u64,
    /// XXH3-64 of the particles, as 16 hex digits.
    #[serde(with = "sim_contract::json_hash")]
    #[schemars(with = "String")]
    pub state_hash: u64,
    /// Number of scene loads in this run, minus one.
    pub topology_revision: u32,
    /// Number of torn constraints.
    pub torn_count: u32,
    /// Outcomes that this state includes: those with a lower index.
    pub outcome_count: u64,
    /// Delay of the step after its deadline, in nanoseconds.
    pub wake_late_ns: u64,
    /// Computing time of the solver, in nanoseconds.
    pub solve_ns: u64,
    /// Number of snapshots that the run has published before this one, modulo 2^32. Numbers that are
    /// left out are missing snapshots.
    pub snapshot_index: u32,
    /// Energy of the state. Absent where it was not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyRow>,
}

impl From<&SnapshotHeader> for StepRow {
    fn from(header: &SnapshotHeader) -> Self {
        Self {
            step: header.step,
            scene_step: header.scene_step,
            state_hash: header.state_hash,
            topology_revision: header.topology_revision,
            torn_count: header.torn_count,
            outcome_count: header.outcome_count,
            wake_late_ns: header.wake_late_ns,
            solve_ns: header.solve_ns,
            snapshot_index: header.snapshot_index,
            energy: None,
        }
    }
}

/// The mechanical energy of a state in J, if the scene is in metres.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnergyRow {
    /// Of the free particles.
    pub kinetic: f64,
    /// Of the free particles in gravity: the sum of -m g.x, with x from the origin of the scene.
    pub potential: f64,
    /// Of the constraints and bends that are not torn.
    pub elastic: f64,
}

impl EnergyRow {
    /// Returns the sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.elastic
    }
}

impl From<Energy> for EnergyRow {
    fn from(Energy { kinetic, potential, elastic }: Energy) -> Self {
        Self { kinetic, potential, elastic }
    }
}
