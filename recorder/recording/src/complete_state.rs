//! Complete states of a recording: found in it, or simulated from the last keyframe before the step.

use std::io::Read;
use std::ops::RangeInclusive;

use sim_messages::{ParticleState, StopFlag, scene_hash};

use super::log::{Frame, FrameReader, LogEnd, LogReader, Message, ReadError, Tape, TapeError};
use super::scene_state::{RecordedSceneError, recorded_scene, scene_to_simulate};
use super::verification::{NotIdentical, Resimulation, ResimulationError};

/// A complete state, from which a simulation continues with the recorded bits.
#[derive(Debug, Clone, PartialEq)]
pub struct CompleteState {
    /// Hash of the scene that the state belongs to.
    pub scene_hash: u64,
    /// Shape: particle count.
    pub particles: Vec<ParticleState>,
    /// The rest of the state: an encoded [`sim_solver::Keyframe`].
    pub keyframe: Vec<u8>,
    /// Hash of the particles and of the torn constraints.
    pub state_hash: u64,
}

/// The reason why a recording gives no complete state of a step.
#[derive(Debug, thiserror::Error)]
pub enum CompleteStateError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A recorded state cannot be read.
    #[error(transparent)]
    Tape(#[from] TapeError),
    /// The recording has no scene that can be simulated again.
    #[error(transparent)]
    Scene(#[from] RecordedSceneError),
    /// The state to start from is invalid.
    #[error(transparent)]
    Start(#[from] ResimulationError),
    /// The simulation does not lead to the recorded states.
    #[error(transparent)]
    NotIdentical(#[from] NotIdentical),
    /// There is no complete state to start from.
    #[error("has no complete state up to step {step} to start from")]
    NoStart {
        /// The wanted step.
        step: u64,
    },
    /// The last complete state is too many steps before the wanted one.
    #[error("step {step} takes {count} steps from the last complete state (allowed: up to {max})")]
    TooFar {
        /// The wanted step.
        step: u64,
        /// Number of steps to simulate.
        count: u64,
        /// The limit.
        max: u64,
    },
    /// The readable part ends before the step.
    #[error("ends before step {step}")]
    Ended {
        /// The wanted step.
        step: u64,
    },
}

/// Returns the complete state of a step, also of one whose snapshot is not in the file.
///
/// It is simulated from the last complete state up to the step, for at most `steps_max` steps, and compared
/// with every snapshot on the way. A step without a snapshot is proved by the next snapshot. After a signal, it ends with [`ReadError::Interrupted`] or [`NotIdentical::Interrupted`].
///
/// # Errors
/// If the file cannot be read, or the recording does not lead to the step.
pub fn complete_state(
    tape: &mut Tape,
    step: u64,
    steps_max: u64,
    stop: &StopFlag,
) -> Result<CompleteState, CompleteStateError> {
    let first = find_start(tape, step)?;
    let begin = first.row.step;
    let count = step - begin;
    if count > steps_max {
        return Err(CompleteStateError::TooFar { step, count, max: steps_max });
    }
    let log = tape.log().reader(stop)?;
    let simulated = Simulated::start(&log, &first, step)?;
    let mut frames = FrameReader::new(log);
    if count > 0 {
        tape.wind(&mut frames, begin)?;
    }
    simulated.advance(&mut frames, step, stop)
}

/// Returns the state at a place that [`find_state`] has found in the same file, simulated from its keyframe by
/// `threads` threads, and compared with every snapshot on the way.
///
/// # Errors
/// If the file cannot be read, or the recording does not lead to the step.
pub fn state_at_place<R: Read>(
    log: LogReader<R>,
    place: &StatePlace,
    threads: usize,
    stop: &StopFlag,
) -> Result<CompleteState, CompleteStateError> {
    let StatePlace { step, keyframe_step, .. } = *place;
    let mut first = None;
    let mut frames = FrameReader::new(log);
    while first.as_ref().is_none_or(|frame: &Frame| frame.row.step < keyframe_step) {
        first = Some(frames.next_frame()?.ok_or(CompleteStateError::Ended { step })?);
    }
    let first = first.ok_or(CompleteStateError::NoStart { step })?;
    let mut simulated = Simulated::start(frames.log(), &first, step)?;
    simulated.simulation.set_threads(threads);
    simulated.advance(&mut frames, step, stop)
}

/// The simulation of a recording from one of its complete states.
struct Simulated {
    scene_hash: u64,
    simulation: Resimulation,
}

impl Simulated {
    /// Starts at a complete state, to simulate up to a step.
    fn start<R: Read>(
        log: &LogReader<R>,
        first: &Frame,
        step: u64,
    ) -> Result<Self, CompleteStateError> {
        let is_simulated = step > first.row.step;
        let scene = if is_simulated { scene_to_simulate(log)? } else { recorded_scene(log)? };
        let simulation = Resimulation::start(&scene, first)?;
        let mut simulation = simulation.ok_or(CompleteStateError::NoStart { step })?;
        simulation.compare_start(first).require_identical()?;
        Ok(Self { scene_hash: scene_hash(log.scene()), simulation })
    }

    /// Simulates up to a step. A step without a snapshot is proved by the next one.
    fn advance<R: Read>(
        mut self,
        frames: &mut FrameReader<R>,
        step: u64,
        stop: &StopFlag,
    ) -> Result<CompleteState, CompleteStateError> {
        while self.simulation.step() < step {
            let frame = frames.next_frame()?.ok_or(CompleteStateError::Ended { step })?;
            if frame.row.step > step {
                self.simulation.advance_to(step, &frame, stop.flag()).require_identical()?;
                let state = self.state();
                self.simulation.advance(&frame, stop.flag()).require_identical()?;
                return Ok(state);
            }
            self.simulation.advance(&frame, stop.flag()).require_identical()?;
        }
        Ok(self.state())
    }

    fn state(&self) -> CompleteState {
        CompleteState {
            scene_hash: self.scene_hash,
            particles: self.simulation.particles().to_vec(),
            keyframe: self.simulation.keyframe().encode(),
            state_hash: self.simulation.state_hash(),
        }
    }
}

/// Returns the last complete state up to a step.
fn find_start(tape: &mut Tape, step: u64) -> Result<Frame, CompleteStateError> {
    let mut up_to = step;
    loop {
        let no_start = CompleteStateError::NoStart { step };
        let Some((begin, bytes)) = tape.keyframe_at(up_to)? else { return Err(no_start) };
        let state = tape.state_at(begin)?;
        // The snapshot or the header of the keyframe may be missing.
        if state.has_readable_row && state.row.step == begin {
            return Ok(Frame {
                updates: vec![Message::Keyframe { step: begin, bytes }],
                row: state.row,
                particles: Some(state.particles.to_vec()),
                log_times_ns: Vec::new(),
            });
        }
        up_to = begin.checked_sub(1).ok_or(no_start)?;
    }
}

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
#[derive(Debug, Clone)]
pub struct StatePlace {
    /// The step of the state.
    pub step: u64,
    /// The last step up to it with a keyframe.
    pub keyframe_step: u64,
    /// The end of the file, if it was reached.
    pub end: Option<LogEnd>,
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
        /// The end of the file, if it explains the lack.
        end: Option<LogEnd>,
        /// The steps from the first complete state to the last snapshot, if there is a complete state.
        steps: Option<RangeInclusive<u64>>,
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
    let (mut keyframe_step, mut steps) = (None, None);
    // The nearest snapshots before and after the wanted step.
    let (mut before, mut behind) = (None, None);
    while let Some(frame) = frames.next_frame()? {
        let (step, is_complete) = (frame.row.step, frame.is_complete_state());
        if is_complete || steps.is_some() {
            let first = steps.as_ref().map_or(step, |steps: &RangeInclusive<u64>| *steps.start());
            steps = Some(first..=step);
        }
        let is_later = match wanted {
            Wanted::Last => false,
            Wanted::Step(wanted) | Wanted::UpTo(wanted) => step > wanted,
        };
        if is_later {
            behind.get_or_insert(step);
            // Without a state, the error names all steps that the file has.
            if keyframe_step.is_some() {
                break;
            }
            continue;
        }
        before = Some(step);
        if is_complete {
            keyframe_step = Some(step);
        }
    }
    let end = frames.end().cloned();
    let found = keyframe_step.zip(before);
    let found =
        found.map(|(keyframe_step, step)| StatePlace { step, keyframe_step, end: end.clone() });
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
    let end = end.filter(|_| behind.is_none());
    found.ok_or_else(|| FindStateError::Missing { problem: problem(), end, steps })
}
