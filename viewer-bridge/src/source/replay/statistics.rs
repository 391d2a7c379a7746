//! Statistics of a recording: those of the node at the time of the recording, and the stretch and energy
//! of the state on show.

use recording::{StatusRow, TapeState};
use sim_contract::ParticleFlags;

use super::open::Recording;
use super::playhead::Playhead;
use crate::scene::measure::{measure, torn_flags};
use crate::source::shown_state::ShownState;
use crate::wire::{
    Percentiles, Stamp, Statistics, count_u32, microseconds, statistics_flag, to_f32,
};

/// Collects the recorded statistics and measures the state.
pub(super) fn statistics(
    recording: &Recording,
    state: &TapeState,
    shown: &ShownState,
    playhead: &Playhead,
    gravity: [f32; 3],
) -> Statistics {
    let constraints = &recording.load.constraints;
    let is_torn = torn_flags(constraints.len(), shown.torn());
    let measures = measure(&state.particles, constraints, &is_torn, gravity);
    let is_frozen = |flags: u32| flags & ParticleFlags::FROZEN != 0;
    let frozen = state.particles.iter().filter(|particle| is_frozen(particle.flags));
    let pace_hz = f64::from(recording.tape.run().rate_hz) * f64::from(playhead.rate);
    let status = state.status.as_ref();
    let us = |field: fn(&StatusRow) -> u64| {
        status.map_or(f32::NAN, |status| microseconds(field(status)))
    };
    let count = |field: fn(&StatusRow) -> u64| status.map_or(0, field);
    let paused = if playhead.is_playing { 0 } else { statistics_flag::PAUSED };
    Statistics {
        stamp: Stamp { epoch: shown.epoch(), step: state.row.step },
        solve_us: Percentiles { p50: us(|row| row.solve_ns_p50), p99: us(|row| row.solve_ns_p99) },
        wake_late_us: Percentiles {
            p50: us(|row| row.wake_late_ns_p50),
            p99: us(|row| row.wake_late_ns_p99),
        },
        period_us: to_f32(1e6 / pace_hz),
        real_time_factor: if playhead.is_playing { playhead.rate } else { 0.0 },
        time_scale: playhead.rate,
        stretch_mean: measures.stretch_mean,
        stretch_max: measures.stretch_max,
        stretch_max_constraint: measures.stretch_max_constraint,
        kinetic_j: measures.kinetic_j,
        potential_j: measures.potential_j,
        late_steps: count(|row| row.late_steps),
        skipped_periods: count(|row| row.skipped_periods),
        outcome_count: state.row.outcome_count,
        rejected_count: count(|row| row.rejected_count),
        frozen_count: count_u32(frozen.count()),
        torn_count: state.row.torn_count,
        flags: statistics_flag::REPLAY | paused,
        ..Statistics::default()
    }
}
