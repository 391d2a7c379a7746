//! What is told four times a second.

use sim_contract::StatusFlags;

use super::Link;
use crate::pages::hub::Hub;
use crate::scene::measure::measure;
use crate::shown_state::{Stage, single};
use crate::wire::{Stamp, Statistics, statistics_flag};

impl Link {
    /// Sends how node and simulation do, if anybody is there.
    pub(super) fn tell_statistics(&self, stage: &mut Stage, hub: &Hub) {
        let client_count = hub.client_count();
        let rate = stage.take_encode_rate();
        if client_count == 0 {
            return;
        }
        let (Some(status), Some((load, snapshot))) = (&self.status, self.on_show()) else { return };
        let gravity = self.known.gravity();
        let measures = measure(snapshot.particles(), &load.constraints, &self.is_torn, gravity);
        let micros = |ns: u64| single(ns as f64 / 1000.0);
        let small = |count: u64| u32::try_from(count).unwrap_or(u32::MAX);
        let flag = |own: u32, flag: u32| if status.flags & own == 0 { 0 } else { flag };
        let pace_hz = f64::from(status.rate_hz) * status.time_scale;
        let statistics = Statistics {
            stamp: Stamp { epoch: stage.epoch(), step: snapshot.header().step },
            solve_us: [micros(status.solve_ns_p50), micros(status.solve_ns_p99)],
            wake_late_us: [micros(status.wake_late_ns_p50), micros(status.wake_late_ns_p99)],
            period_us: single(1e6 / pace_hz),
            real_time_factor: single(status.real_time_factor),
            time_scale: single(status.time_scale),
            stretch_mean: measures.stretch_mean,
            stretch_max: measures.stretch_max,
            stretch_max_constraint: measures.stretch_max_constraint,
            kinetic_j: measures.kinetic_j,
            potential_j: measures.potential_j,
            late_steps: status.late_steps,
            skipped_periods: status.skipped_periods,
            outcome_count: status.outcome_count,
            rejected_count: status.rejected_count,
            frozen_count: small(status.frozen_count),
            torn_count: status.torn_count,
            reader_count: status.reader_count,
            client_count: small(client_count as u64),
            encode_us: rate.encode_us,
            frames_per_second: rate.frames_per_second,
            flags: flag(StatusFlags::PAUSED, statistics_flag::PAUSED)
                | flag(StatusFlags::REPLAY, statistics_flag::REPLAY),
        };
        hub.broadcast_binary(statistics.encode());
    }
}
