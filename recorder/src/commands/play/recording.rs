//! One file of a replay, read forward from any step.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use recording::{
    CompleteStateError, ContentSelection, FileSource, Frame, FrameReader, LogEnd, LogReader,
    Message, RecordedSceneError, RecordedState, RunDescription, StepRow, Tape, complete_state,
    counted, open_recording, recorded_scene,
};
use sim_contract::BendState;
use sim_host::Stop;
use sim_solver::Solver;

use super::replay::Recorded;
use crate::cli::damaged_input::lacks;
use crate::cli::output;

/// A recording that is read forward from any step.
#[derive(Debug)]
pub(super) struct Recording {
    path: PathBuf,
    frames: FrameReader<FileSource>,
    tape: Tape,
    /// `None` until a load is published.
    needs: Option<Needs>,
    /// The header of the last snapshot that was read.
    last_row: Option<StepRow>,
    /// A warning has named a gap in the file.
    has_named_gap: bool,
    stop: Stop,
}

/// Needs of the messages of a load besides its rows.
#[derive(Debug)]
struct Needs {
    /// Number of colliders. It never changes in a recording.
    collider_count: usize,
    keyframe_size_bytes_max: usize,
    bends: Vec<BendState>,
}

/// A place in a recording: its next snapshot, and the state before it.
#[derive(Debug)]
pub(super) struct Start {
    pub(super) frame: Frame,
    pub(super) state: RecordedState,
}

impl Start {
    /// Returns the first snapshot of a file as the next one of the run that has reached a state, with the last
    /// messages of the file before: without every snapshot of the run, they follow the last one. Returns
    /// `None` if they do not lead to the state with which this file begins.
    pub(super) fn continue_from(
        self,
        reached: &RecordedState,
        trailing: &[Message],
    ) -> Option<Frame> {
        let Self { mut frame, state: mut begun } = self;
        frame.updates.iter().for_each(|update| begun.apply(update));
        let step = frame.row.step;
        // The file repeats what was latched before its first step.
        let own = frame.updates.into_iter().filter(|update| update.step() >= step);
        // An outcome of this step can arrive before the file before ends. No file repeats one.
        let is_missing =
            |update: &&Message| update.step() < step || matches!(update, Message::Outcome(_));
        let earlier = trailing.iter().filter(is_missing).cloned();
        frame.updates = earlier.chain(own).collect();
        let mut reached = reached.clone();
        frame.updates.iter().for_each(|update| reached.apply(update));
        agree(&reached, &begun).then_some(frame)
    }
}

impl Recording {
    /// Opens a file at its first snapshot. Errors do not name the file.
    pub(super) fn open(path: &Path, stop: &Stop) -> anyhow::Result<Self> {
        let file = Arc::new(open_recording(path)?);
        let log = LogReader::of_file(Arc::clone(&file), Some(stop))?;
        log.selection().require_all_particles("`recorder play`")?;
        // Names the problem of a file whose readable part has no snapshot.
        let mut frames = FrameReader::new(log);
        next_frame(path, &mut frames)?;
        let tape = Tape::of_file(file, Some(stop), &mut |_, _| {})?;
        tape.rewind(&mut frames);
        Ok(Self {
            path: path.to_owned(),
            frames,
            tape,
            needs: None,
            last_row: None,
            has_named_gap: false,
            stop: stop.clone(),
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn run(&self) -> &RunDescription {
        self.tape.run()
    }

    pub(super) fn tape(&mut self) -> &mut Tape {
        &mut self.tape
    }

    pub(super) fn scene(&self) -> &[u8] {
        self.frames.log().scene()
    }

    pub(super) fn selection(&self) -> ContentSelection {
        self.frames.log().selection()
    }

    /// Returns the data of the load.
    pub(super) fn recorded(&mut self) -> anyhow::Result<Recorded<'_>> {
        let needs = match self.needs.take() {
            Some(needs) => needs,
            None => self.find_needs()?,
        };
        let Needs { collider_count, keyframe_size_bytes_max, bends } = self.needs.insert(needs);
        Ok(Recorded {
            run: self.tape.run(),
            scene: self.frames.log().scene(),
            topology: self.tape.topology(),
            bends,
            surface: self.tape.surface(),
            collider_count: *collider_count,
            keyframe_size_bytes_max: *keyframe_size_bytes_max,
        })
    }

    fn find_needs(&self) -> anyhow::Result<Needs> {
        let solver = Solver::new(&recorded_scene(self.frames.log())?);
        let bends = self.tape.topology().bends();
        Ok(Needs {
            collider_count: solver.collider_count(),
            keyframe_size_bytes_max: solver.keyframe_size_bytes_max(),
            bends: bends.context("the columns of the bends in /topology differ in length")?,
        })
    }

    /// Continues with the snapshot of the last recorded step up to `step` whose header is readable. Its state
    /// is complete, if the recording leads to it.
    pub(super) fn start_at(&mut self, step: u64) -> anyhow::Result<Start> {
        if step <= self.tape.first_step() { self.start() } else { self.start_in_the_middle(step) }
    }

    /// Continues with the first snapshot.
    pub(super) fn start(&mut self) -> anyhow::Result<Start> {
        self.tape.rewind(&mut self.frames);
        let frame = next_frame(&self.path, &mut self.frames)?;
        let state = RecordedState::before_first(self.tape.topology(), &frame);
        self.last_row = Some(frame.row);
        Ok(Start { frame, state })
    }

    fn start_in_the_middle(&mut self, step: u64) -> anyhow::Result<Start> {
        let mut state = self.tape.state_at(step)?;
        // A snapshot without its header would be published with a state hash of 0.
        while !state.has_readable_row {
            if state.row.step <= self.tape.first_step() {
                return self.start();
            }
            state = self.tape.state_at(state.row.step - 1)?;
        }
        let step = state.row.step;
        let keyframe = match self.keyframe_of(step)? {
            Some(bytes) => Some((step, bytes)),
            None => self.tape.keyframe_at(step)?,
        };
        if let Some((step, bytes)) = keyframe {
            state.set_keyframe(step, bytes);
        }
        self.tape.wind(&mut self.frames, step)?;
        self.last_row = Some(state.row);
        let frame = Frame {
            updates: Vec::new(),
            row: state.row,
            particles: Some(Arc::unwrap_or_clone(std::mem::take(&mut state.particles))),
            log_times_ns: Vec::new(),
        };
        Ok(Start { frame, state })
    }

    /// Returns the keyframe of a recorded step, simulated if it has none of its own; `None` if the recording
    /// does not lead to it.
    pub(super) fn keyframe_of(&mut self, step: u64) -> anyhow::Result<Option<Vec<u8>>> {
        keyframe_of(&mut self.tape, step, &self.stop)
    }

    /// Returns the next snapshot, or `None` at the end of the readable part. Warns of the first gap before one,
    /// because a replay numbers its snapshots anew.
    pub(super) fn next_frame(&mut self) -> anyhow::Result<Option<Frame>> {
        let frame = self.frames.next_frame()?;
        if let Some(frame) = &frame {
            let last = self.last_row.replace(frame.row);
            if let Some(last) = last.filter(|_| !self.has_named_gap) {
                self.warn_of_gap(&last, &frame.row);
            }
        }
        Ok(frame)
    }

    fn warn_of_gap(&mut self, last: &StepRow, row: &StepRow) {
        let missing = self.selection().missing_between(last.snapshot_index, row.snapshot_index);
        if missing == 0 {
            return;
        }
        self.has_named_gap = true;
        let (path, from, to) = (output::path_text(&self.path), last.step, row.step);
        let snapshots = counted(missing, "snapshot");
        output::note(&format!(
            "warning: {path} lacks {snapshots} between steps {from} and {to}, and possibly more later; \
             `recorder info` reports the total. A recording of this replay does not show the gap"
        ));
    }

    /// Returns the messages after the last snapshot, once [`Self::next_frame`] has returned `None`.
    pub(super) fn trailing_updates(&self) -> &[Message] {
        self.frames.trailing_updates()
    }

    /// Returns the end of the file, once it was reached.
    pub(super) fn end(&self) -> Option<&LogEnd> {
        self.frames.end()
    }
}

/// Returns `true` if the torn constraints, colliders and parameters are the same in both, as far as they are known.
fn agree(one: &RecordedState, two: &RecordedState) -> bool {
    let torn = |state: &RecordedState| state.torn.indices().collect::<BTreeSet<_>>();
    let are_known = one.colliders.is_some() && two.colliders.is_some();
    (!are_known || one.collider_states() == two.collider_states())
        && one.parameter_values() == two.parameter_values()
        && torn(one) == torn(two)
}

fn next_frame(path: &Path, frames: &mut FrameReader<FileSource>) -> anyhow::Result<Frame> {
    let frame = frames.next_frame()?;
    frame.ok_or_else(|| lacks(path, "has no snapshot to play", frames.end()))
}

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
