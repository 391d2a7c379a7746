//! Messages about the recording, its playback and the state on show.

use recording::{RecordedState, StatusRow};
use sim_contract::ParticleFlags;

use super::check::Report;
use super::open::{Recording, incomplete};
use super::playhead::Playhead;
use crate::message::{Node, NodeState, Playback, Timeline};
use crate::scene::measure::{measure, torn_flags};
use crate::source::shown_state::ShownState;
use crate::wire::{
    Percentiles, Stamp, Statistics, count_u32, microseconds, statistics_flag, to_f32,
};

/// Describes the contents of the recording.
pub(super) fn timeline(recording: &Recording, report: &Report) -> Timeline {
    let tape = &recording.tape;
    Timeline {
        file: recording.file.clone(),
        scene: tape.run().scene_name.clone(),
        rate_hz: tape.run().rate_hz,
        first_step: tape.first_step(),
        last_step: tape.last_step(),
        first_time_s: recording.time_s(tape.first_step()),
        last_time_s: recording.time_s(tape.last_step()),
        marks: report.marks.clone(),
        hashes: report.hashes,
        hash_text: report.hash_text.clone(),
        incomplete: incomplete(tape, &recording.file),
    }
}

/// Describes the playback at the step on show.
pub(super) fn playback(recording: &Recording, playhead: &Playhead, step: u64) -> Playback {
    Playback {
        is_playing: playhead.is_playing,
        rate: playhead.rate,
        is_looping: playhead.is_looping,
        loop_steps: playhead.loop_steps(),
        step,
        time_s: recording.time_s(step),
    }
}

/// Describes the recording as if it were a node.
pub(super) fn node(recording: &Recording, playhead: &Playhead) -> Node {
    let run = recording.tape.run();
    Node {
        state: NodeState::Alive,
        text: String::new(),
        run_id: Some(format!("{:016x}", run.run_id)),
        scene: Some(run.scene_name.clone()),
        method: Some(recording.load.method()),
        rate_hz: run.rate_hz,
        is_paused: !playhead.is_playing,
        is_replay: true,
        time_scale: f64::from(playhead.rate),
        process_id: None,
    }
}

/// Collects the statistics of the node at the time of the recording, and measures the stretch and energy of the state.
pub(super) fn statistics(
    recording: &Recording,
    state: &RecordedState,
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
