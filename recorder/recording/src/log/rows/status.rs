//! The row of `/status`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::NodeStatus;

/// The status of the node, with the fields of [`NodeStatus`]. Recordings of contract version 1 lack
/// the fields with a default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "documented at the fields of NodeStatus")]
pub struct StatusRow {
    pub step: u64,
    pub paused: bool,
    pub replay: bool,
    pub real_time_factor: f64,
    #[serde(default = "real_time")]
    pub time_scale: f64,
    pub wake_late_ns_p50: u64,
    pub wake_late_ns_p99: u64,
    pub solve_ns_p50: u64,
    pub solve_ns_p99: u64,
    pub late_steps: u64,
    pub skipped_periods: u64,
    pub outcome_count: u64,
    pub rejected_count: u64,
    #[serde(default)]
    pub frozen_count: u64,
    #[serde(default)]
    pub standing_body_steps: u64,
    pub rate_hz: u32,
    pub particle_count: u32,
    pub constraint_count: u32,
    #[serde(default)]
    pub torn_count: u32,
    pub reader_count: u32,
    pub process_id: u32,
    pub scene_name: String,
}

impl From<&NodeStatus> for StatusRow {
    fn from(status: &NodeStatus) -> Self {
        let finite = |number: f64| if number.is_finite() { number } else { 0.0 };
        Self {
            step: status.step,
            paused: status.is_paused(),
            replay: status.is_replay(),
            real_time_factor: finite(status.real_time_factor),
            time_scale: finite(status.time_scale),
            wake_late_ns_p50: status.wake_late_ns_p50,
            wake_late_ns_p99: status.wake_late_ns_p99,
            solve_ns_p50: status.solve_ns_p50,
            solve_ns_p99: status.solve_ns_p99,
            late_steps: status.late_steps,
            skipped_periods: status.skipped_periods,
            outcome_count: status.outcome_count,
            rejected_count: status.rejected_count,
            frozen_count: status.frozen_count,
            standing_body_steps: status.standing_body_steps,
            rate_hz: status.rate_hz,
            particle_count: status.particle_count,
            constraint_count: status.constraint_count,
            torn_count: status.torn_count,
            reader_count: status.reader_count,
            process_id: status.process_id,
            scene_name: status.scene_name(),
        }
    }
}

/// The pace of a node of contract version 1, which had no time scale.
fn real_time() -> f64 {
    1.0
}
