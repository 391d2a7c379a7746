//! State and statistics of a live node, for clients.

use sim_contract::{NodeStatus, StatusFlags};

use super::newest_state::LoadedState;
use crate::message::{Node, NodeState};
use crate::scene::measure::{measure, torn_flags};
use crate::source::shown_state::ShownState;
use crate::wire::{Percentiles, Stamp, Statistics, microseconds, statistics_flag, to_f32};

/// Collects the statistics of the node and measures the state.
pub(super) fn statistics(
    status: &NodeStatus,
    state: LoadedState<'_>,
    shown: &ShownState,
    gravity: [f32; 3],
) -> Statistics {
    let LoadedState { load, header, particles, .. } = state;
    let is_torn = torn_flags(load.constraints.len(), shown.torn());
    let measures = measure(particles, &load.constraints, &is_torn, gravity);
    let percentiles = |p50, p99| Percentiles { p50: microseconds(p50), p99: microseconds(p99) };
    let flag = |own: u32, flag: u32| if status.flags & own == 0 { 0 } else { flag };
    let pace_hz = f64::from(status.rate_hz) * status.time_scale;
    Statistics {
        stamp: Stamp { epoch: shown.epoch(), step: header.step },
        solve_us: percentiles(status.solve_ns_p50, status.solve_ns_p99),
        wake_late_us: percentiles(status.wake_late_ns_p50, status.wake_late_ns_p99),
        period_us: to_f32(1e6 / pace_hz),
        real_time_factor: to_f32(status.real_time_factor),
        time_scale: to_f32(status.time_scale),
        stretch_mean: measures.stretch_mean,
        stretch_max: measures.stretch_max,
        stretch_max_constraint: measures.stretch_max_constraint,
        kinetic_j: measures.kinetic_j,
        potential_j: measures.potential_j,
        late_steps: status.late_steps,
        skipped_periods: status.skipped_periods,
        outcome_count: status.outcome_count,
        rejected_count: status.rejected_count,
        frozen_count: u32::try_from(status.frozen_count).unwrap_or(u32::MAX),
        torn_count: status.torn_count,
        reader_count: status.reader_count,
        flags: flag(StatusFlags::PAUSED, statistics_flag::PAUSED)
            | flag(StatusFlags::REPLAY, statistics_flag::REPLAY),
        ..Statistics::default()
    }
}

/// Describes a node that runs. `method` is that of the load on show.
pub(super) fn node_text(status: Option<&NodeStatus>, method: Option<&'static str>) -> Node {
    let Some(status) = status else {
        return Node {
            state: NodeState::Alive,
            text: "a node is running, but has not published its status yet".to_owned(),
            ..Node::default()
        };
    };
    Node {
        state: NodeState::Alive,
        text: String::new(),
        run_id: Some(format!("{:016x}", status.run_id)),
        scene: Some(status.scene_name()),
        method,
        rate_hz: status.rate_hz,
        is_paused: status.is_paused(),
        is_replay: status.is_replay(),
        time_scale: status.time_scale,
        process_id: Some(status.process_id),
    }
}
