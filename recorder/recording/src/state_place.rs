//! Finds a state in a recording, and the complete state from which it can be simulated.

use std::io::Read;

use crate::log::{FrameReader, LogEnd, LogReader, ReadError};

/// The state to look for.
#[derive(Debug, Clone, Copy)]
pub enum Wanted {
    /// The last one.
    Last,
    /// The state of this step.
    Step(u64),
    /// The last one up to this step.
    UpTo(u64),
}

/// The steps of a state and of the keyframe to start from.
#[derive(Debug, Clone, Copy)]
pub struct StatePlace {
    /// The step of the state.
    pub step: u64,
    /// The last step up to it with a keyframe.
    pub keyframe_step: u64,
}

/// The reason why a state is not found.
#[derive(Debug, thiserror::Error)]
pub enum FindStateError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The readable part of the file lacks the state.
    #[error("{problem}")]
    Missing {
        /// The content that it lacks.
        problem: String,
        /// The end of the file, if it was reached.
        end: Option<LogEnd>,
    },
}

/// Finds the wanted state in a file, and the last keyframe up to it.
///
/// # Errors
/// If the file cannot be read, or has no such state.
pub fn find_state<R: Read>(
    log: LogReader<R>,
    wanted: Wanted,
) -> Result<StatePlace, FindStateError> {
    let mut frames = FrameReader::new(log);
    let (mut found, mut keyframe_step) = (None, None);
    // The nearest snapshots before and after the wanted step.
    let (mut before, mut behind) = (None, None);
    while let Some(frame) = frames.next_frame()? {
        let step = frame.row.step;
        let is_later = match wanted {
            Wanted::Last => false,
            Wanted::Step(wanted) | Wanted::UpTo(wanted) => step > wanted,
        };
        if is_later {
            behind = Some(step);
            break;
        }
        before = Some(step);
        if frame.own_keyframe().is_some() && frame.particles.is_some() {
            keyframe_step = Some(step);
        }
        found = keyframe_step.map(|keyframe_step| StatePlace { step, keyframe_step });
    }
    let found = found.filter(|place| match wanted {
        Wanted::Step(wanted) => place.step == wanted,
        Wanted::Last | Wanted::UpTo(_) => true,
    });
    let problem = || {
        let (Wanted::Step(step) | Wanted::UpTo(step)) = wanted else {
            return if before.is_none() { "has no snapshot" } else { "has no keyframe" }.to_owned();
        };
        let reason = match (before, behind) {
            (None, None) => return "has no snapshot".to_owned(),
            (None, Some(behind)) => format!("it begins with step {behind}"),
            (Some(_), _) if keyframe_step.is_none() => "no keyframe precedes it".to_owned(),
            (Some(before), None) => format!("it ends with step {before}"),
            (Some(before), Some(behind)) => {
                format!("the nearest snapshots are those of steps {before} and {behind}")
            }
        };
        format!("has no complete state of step {step}: {reason}")
    };
    found.ok_or_else(|| FindStateError::Missing { problem: problem(), end: frames.end().cloned() })
}
