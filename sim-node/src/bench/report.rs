//! The report, as `--json` prints it.

use serde::Serialize;

use super::machine::Machine;
use super::measurement::Mode;
use super::times::Percentiles;
use crate::node::RealTime;

#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) scene: String,
    pub(super) particle_count: usize,
    pub(super) rate_hz: u32,
    /// Threads of the solver.
    pub(super) thread_count: usize,
    pub(super) duration_s: f64,
    pub(super) build: Build,
    pub(super) machine: Machine,
    pub(super) real_time: RealTime,
    /// Wake-up lateness of a loop that only sleeps.
    pub(super) bare_loop: Percentiles,
    pub(super) loops: Vec<LoopRow>,
    pub(super) latencies: Vec<LatencyRow>,
    pub(super) commands: Vec<CommandRow>,
    pub(super) lockstep: LockstepRow,
}

/// Profile of this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Build {
    Debug,
    Release,
}

/// Loop of a node with readers that wait for its event.
#[derive(Debug, Serialize)]
pub(super) struct LoopRow {
    pub(super) reader_count: usize,
    pub(super) wake_late: Percentiles,
    /// Percentiles of the lateness, divided by those of the bare loop.
    pub(super) wake_late_ratio_p50: Option<f64>,
    pub(super) wake_late_ratio_p99: Option<f64>,
    pub(super) late_step_count: u64,
    pub(super) phases: PhaseRow,
}

/// Percentiles of the phases of a step.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct PhaseRow {
    pub(super) drain: Percentiles,
    pub(super) solve: Percentiles,
    pub(super) publish: Percentiles,
    pub(super) wake: Percentiles,
    pub(super) keep: Percentiles,
    pub(super) observe: Percentiles,
    pub(super) outside_solver: Percentiles,
}

/// Time from the publication of a snapshot to its reception.
#[derive(Debug, Serialize)]
pub(super) struct LatencyRow {
    pub(super) reader_count: usize,
    pub(super) wait: Wait,
    pub(super) latency: Percentiles,
    pub(super) missed_count: u64,
}

/// Way of a reader to wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Wait {
    Event,
    Poll,
}

/// Time from a command to its outcome.
#[derive(Debug, Serialize)]
pub(super) struct CommandRow {
    pub(super) node: Mode,
    pub(super) round_trip: Percentiles,
}

/// Steps of a node with one member, as fast as possible.
#[derive(Debug, Serialize)]
pub(super) struct LockstepRow {
    pub(super) steps_per_s: f64,
    pub(super) round_trip: Percentiles,
}
