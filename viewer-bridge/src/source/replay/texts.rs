//! Messages about the recording and its playback.

use super::check::Report;
use super::open::{Recording, incomplete};
use super::playhead::Playhead;
use crate::message::{Node, NodeState, Playback, Timeline};

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
