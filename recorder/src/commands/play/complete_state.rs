//! The complete state of a step in the middle of a recording, simulated from the last keyframe before it.

use std::path::Path;

use recorder::verification::{Resimulation, SnapshotFinding};
use recorder::{Frame, FrameReader, LogReader, Message, Tape, recorded_scene};
use sim_contract::{Method, Stop, Torn};
use sim_solver::SOLVER_VERSION;

use super::position::Position;

/// Most work of a simulation, in steps of one particle: about two seconds on one thread. A jump in a scene
/// of a million particles, or after a second without keyframes, does not stop the replay for longer.
const PARTICLE_STEPS_MAX: u64 = 100_000_000;

/// Returns the keyframe of a recorded step: its own, or the one that a simulation from the last keyframe
/// before it gives. Returns `None` if that does not lead to the recorded particles: after missing
/// commands, with another version of the solver, or where the recording is damaged. `path` is the file of
/// `tape`.
///
/// # Errors
/// If the file cannot be read.
pub(super) fn keyframe_of(
    path: &Path,
    tape: &mut Tape,
    step: u64,
    stop: &Stop,
) -> anyhow::Result<Option<Vec<u8>>> {
    let Some((begin, bytes)) = tape.keyframe_at(step)? else { return Ok(None) };
    if begin == step {
        return Ok(Some(bytes));
    }
    let run = tape.run();
    let work = (step - begin).saturating_mul(run.particle_count.into());
    if run.solver_version != SOLVER_VERSION || work > PARTICLE_STEPS_MAX {
        return Ok(None);
    }
    let method = Method::from_number(run.method).unwrap_or_default();
    let state = tape.state_at(begin)?;
    if !state.has_readable_row || state.row.step != begin {
        return Ok(None);
    }
    let mut passed = Position::new(Torn::default(), method);
    let keyframe = Message::Keyframe { step: begin, bytes };
    passed.apply(&keyframe);
    let first = Frame {
        updates: vec![keyframe],
        row: state.row,
        particles: Some(state.particles.to_vec()),
        log_times_ns: Vec::new(),
    };
    let mut frames = FrameReader::new(LogReader::open_until(path, stop)?);
    let scene = recorded_scene(frames.log())?;
    // A keyframe that this solver refuses leads to no state.
    let Ok(Some(mut simulation)) = Resimulation::start(&scene, &first) else { return Ok(None) };
    tape.wind(&mut frames, begin)?;
    while let Some(frame) = frames.next_frame()? {
        let is_same = simulation.advance(&frame, stop.flag()) == SnapshotFinding::Identical;
        if !is_same || frame.row.step > step {
            return Ok(None);
        }
        frame.updates.iter().for_each(|update| passed.apply(update));
        if frame.row.step == step {
            let mut keyframe = simulation.keyframe();
            // The solver does not know whether the node was paused.
            keyframe.paused = passed.is_paused;
            return Ok(Some(keyframe.encode()));
        }
    }
    Ok(None)
}
