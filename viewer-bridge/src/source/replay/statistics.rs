//! What is told four times a second: how the node did when this was recorded, and stretch and energy
//! of the state on show.

use recorder::StatusRow;
use sim_contract::ParticleFlags;

use super::player::Player;
use crate::scene::measure::measure;
use crate::shown_state::single;
use crate::wire::{Stamp, Statistics, statistics_flag};

impl Player<'_> {
    /// Sends it, if anybody is there.
    pub(super) fn tell_statistics(&mut self) {
        let client_count = self.hub.client_count();
        let rate = self.stage.take_encode_rate();
        if client_count == 0 {
            return;
        }
        let (state, head) = (&self.state, &self.playhead);
        let constraints = &self.replay.load.constraints;
        let mut is_torn = vec![false; constraints.len()];
        for constraint in &state.torn.constraints {
            if let Some(is_torn) = is_torn.get_mut(*constraint as usize) {
                *is_torn = true;
            }
        }
        let values = self.parameters.as_ref().and_then(|text| text.values);
        let gravity = values.map_or([0.0; 3], |values| values.gravity.map(|axis| axis.0));
        let measures = measure(&state.particles, constraints, &is_torn, gravity);
        let is_frozen = |flags: u32| flags & ParticleFlags::FROZEN != 0;
        let frozen_count = state.particles.iter().filter(|one| is_frozen(one.flags)).count();
        let small = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let pace_hz = f64::from(self.replay.tape.run().rate_hz) * f64::from(head.rate);
        let status = state.status.as_ref();
        let micros = |of: fn(&StatusRow) -> u64| {
            status.map_or(f32::NAN, |status| single(of(status) as f64 / 1000.0))
        };
        let count = |of: fn(&StatusRow) -> u64| status.map_or(0, of);
        let paused = if head.is_playing { 0 } else { statistics_flag::PAUSED };
        let statistics = Statistics {
            stamp: Stamp { epoch: self.stage.epoch(), step: state.row.step },
            solve_us: [micros(|row| row.solve_ns_p50), micros(|row| row.solve_ns_p99)],
            wake_late_us: [micros(|row| row.wake_late_ns_p50), micros(|row| row.wake_late_ns_p99)],
            period_us: single(1e6 / pace_hz),
            real_time_factor: if head.is_playing { head.rate } else { 0.0 },
            time_scale: head.rate,
            stretch_mean: measures.stretch_mean,
            stretch_max: measures.stretch_max,
            stretch_max_constraint: measures.stretch_max_constraint,
            kinetic_j: measures.kinetic_j,
            potential_j: measures.potential_j,
            late_steps: count(|row| row.late_steps),
            skipped_periods: count(|row| row.skipped_periods),
            outcome_count: state.row.outcome_count,
            rejected_count: count(|row| row.rejected_count),
            frozen_count: small(frozen_count),
            torn_count: state.row.torn_count,
            reader_count: 0,
            client_count: small(client_count),
            encode_us: rate.encode_us,
            frames_per_second: rate.frames_per_second,
            flags: statistics_flag::REPLAY | paused,
        };
        self.hub.broadcast_binary(statistics.encode());
    }
}
