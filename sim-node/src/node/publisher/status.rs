//! The status message.

use sim_contract::{CONTRACT_VERSION, NodeStatus, StatusFlags, Wake};
use sim_solver::{SOLVER_VERSION, Scene, Solver};

use super::load::count;
use super::{Position, Publisher};
use crate::node::statistics::Statistics;

impl Publisher {
    pub(crate) fn publish_status(&self, status: &NodeStatus) -> anyhow::Result<()> {
        self.owner.publish_status(status)?;
        self.owner.wake(Wake::Status);
        Ok(())
    }

    /// Status of the node.
    pub(crate) fn status(
        &self,
        scene: &Scene,
        solver: &Solver,
        position: Position,
        statistics: &Statistics,
    ) -> NodeStatus {
        let last = &statistics.last;
        let mut status = NodeStatus {
            contract_version: CONTRACT_VERSION,
            solver_version: SOLVER_VERSION,
            run_id: self.run_id,
            step: position.step,
            real_time_factor: if position.is_paused { 0.0 } else { statistics.real_time_factor },
            wake_late_ns_p50: last.wake_late_ns_p50,
            wake_late_ns_p99: last.wake_late_ns_p99,
            solve_ns_p50: last.solve_ns_p50,
            solve_ns_p99: last.solve_ns_p99,
            late_steps: statistics.late_steps,
            skipped_periods: statistics.skipped_periods,
            outcome_count: self.outcome_count,
            rejected_count: self.rejected_count,
            rate_hz: self.rate_hz,
            particle_count: count(solver.particle_count()),
            constraint_count: count(solver.constraint_count()),
            reader_count: count(self.owner.reader_count()),
            process_id: std::process::id(),
            time_scale: position.time_scale,
            frozen_count: solver.frozen_count(),
            standing_body_steps: solver.standing_body_steps(),
            torn_count: count(solver.torn().len()),
            flags: if position.is_paused { StatusFlags::PAUSED } else { 0 },
            ..NodeStatus::default()
        };
        status.set_scene_name(&scene.name);
        status
    }
}
