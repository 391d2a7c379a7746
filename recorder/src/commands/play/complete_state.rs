//! The complete state of a step in the middle of a recording, simulated from the last keyframe before it.

use recording::{CompleteStateError, RecordedSceneError, Tape, complete_state};
use sim_contract::Stop;

/// Most work of a simulation, in steps of one particle: about two seconds on one thread. A jump in a scene
/// of a million particles, or after a second without keyframes, does not stop the replay for longer.
const PARTICLE_STEPS_MAX: u64 = 100_000_000;

/// Returns the keyframe of a recorded step: its own, or the one that a simulation from the last keyframe
/// before it gives. Returns `None` if that does not lead to the recorded particles: after missing
/// commands, with another version of the solver, or where the recording is damaged.
///
/// # Errors
/// If the file cannot be read.
pub(super) fn keyframe_of(
    tape: &mut Tape,
    step: u64,
    stop: &Stop,
) -> anyhow::Result<Option<Vec<u8>>> {
    let Some((begin, bytes)) = tape.keyframe_at(step)? else { return Ok(None) };
    if begin == step {
        return Ok(Some(bytes));
    }
    let steps_max = PARTICLE_STEPS_MAX / u64::from(tape.run().particle_count).max(1);
    match complete_state(tape, step, steps_max, stop) {
        Ok(state) => Ok(Some(state.keyframe)),
        Err(CompleteStateError::Read(error)) => Err(error.into()),
        Err(CompleteStateError::Tape(error)) => Err(error.into()),
        Err(CompleteStateError::Scene(
            error @ (RecordedSceneError::Missing
            | RecordedSceneError::NotText(_)
            | RecordedSceneError::Invalid(_)),
        )) => Err(error.into()),
        Err(_) => Ok(None),
    }
}
