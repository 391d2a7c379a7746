//! Finds a state in a recording, and the complete state from which it can be simulated.

use std::io::Read;
use std::path::Path;

use recorder::{FrameReader, LogReader};

use crate::cli::damaged_input::lacks;

/// The state to look for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Wanted {
    Last,
    Step(u64),
    /// The last one up to this step.
    UpTo(u64),
}

/// The steps of a state and of the keyframe to start from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) step: u64,
    pub(crate) keyframe_step: u64,
}

/// Finds the wanted state in a file, and the last keyframe up to it.
pub(crate) fn find_state<R: Read>(
    path: &Path,
    log: LogReader<R>,
    wanted: Wanted,
) -> anyhow::Result<Place> {
    let mut frames = FrameReader::new(log);
    let (mut found, mut keyframe_step, mut first) = (None, None, None);
    while let Some(frame) = frames.next_frame()? {
        let step = frame.row.step;
        first.get_or_insert(step);
        let is_later = match wanted {
            Wanted::Last => false,
            Wanted::Step(wanted) | Wanted::UpTo(wanted) => step > wanted,
        };
        if is_later {
            break;
        }
        if frame.own_keyframe().is_some() && frame.particles.is_some() {
            keyframe_step = Some(step);
        }
        found = keyframe_step.map(|keyframe_step| Place { step, keyframe_step });
    }
    let found = found.filter(|place| match wanted {
        Wanted::Step(wanted) => place.step == wanted,
        Wanted::Last | Wanted::UpTo(_) => true,
    });
    let problem = || match (wanted, first) {
        (_, None) => "has no snapshot".to_owned(),
        (Wanted::Step(step) | Wanted::UpTo(step), Some(first)) => format!(
            "has no complete state of step {step}: it begins with step {first}, and `recorder info` \
             shows its steps"
        ),
        (Wanted::Last, Some(_)) => "has no keyframe".to_owned(),
    };
    found.ok_or_else(|| lacks(path, &problem(), frames.end()))
}
