//! Proves that a recording re-simulates bit for bit.
//!
//! A snapshot with its keyframe is a complete state. So a recording is divided at such snapshots into parts, which
//! are simulated side by side: each from its recorded state up to the recorded state with which the next part begins.
//! If all of them are identical, the first state leads to the last one.

mod finding;
mod part;
mod past_states;
mod report;
mod resimulation;
mod rows;

use std::io::{self, Read};
use std::sync::atomic::AtomicBool;
use std::thread;

use sim_solver::Solver;

use super::scene_state::{RecordedSceneError, scene_to_simulate};
use crate::log::{Frame, FrameReader, GapCounter, LogEnd, LogReader, Message, ReadError};
pub use finding::{
    Difference, NotIdentical, SnapshotDifference, SnapshotFinding, StepGap, distance,
    first_difference, snapshot_difference,
};
use part::{PartResult, Parts};
pub use report::{Verdict, VerifyReport};
pub use resimulation::{Resimulation, ResimulationError};
use rows::{compare_counts, compare_load, compare_run};

/// Snapshots between two calls of `on_progress`.
const SNAPSHOTS_PER_UPDATE: u64 = 64;

/// The reason why a recording cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The recording has no scene that can be simulated again.
    #[error(transparent)]
    Scene(#[from] RecordedSceneError),
    /// The operating system refused a thread.
    #[error("cannot start a thread that simulates: {0}")]
    Thread(#[from] io::Error),
    /// The state to start from is invalid.
    #[error(transparent)]
    Start(#[from] ResimulationError),
    /// The recording has no complete state among the steps to compare.
    #[error("has no complete state up to step {step} to start from")]
    NoStateUpTo {
        /// The last step to compare.
        step: u64,
    },
    /// The recording has no complete state.
    #[error("has no snapshot with a keyframe to start from")]
    NoKeyframe {
        /// The end of a file that is not complete.
        end: Option<LogEnd>,
    },
}

/// The steps of a verification.
#[derive(Debug, Clone, Copy)]
pub struct StepRange {
    /// The step to start from, if it has a complete state, or the next one that has.
    pub start: u64,
    /// The last step to compare.
    pub last: u64,
}

/// Options of a verification.
#[derive(Debug, Clone, Copy)]
pub struct VerifyOptions {
    /// Number of threads that simulate; 0 counts as 1. Each simulates a part of the recording. Where the parts of a large
    /// scene do not fit in memory side by side, the threads share the solver of one part.
    pub threads: usize,
    /// The steps to compare.
    pub range: StepRange,
}

/// Simulates a recording again from its recorded states and commands, and compares every state, up to the first
/// difference: particles, hashes, keyframes, tears, parameters, colliders, forces, energies, and the outcomes of
/// commands.
///
/// Calls `on_progress` periodically, with the number of bytes that are read. Ends early, even within a
/// step, if `stop` becomes true.
///
/// # Errors
/// If the file cannot be read, or has no complete state to start from. A difference is no error, but part
/// of the report.
pub fn verify<R: Read>(
    log: LogReader<R>,
    options: VerifyOptions,
    stop: &AtomicBool,
    on_progress: impl FnMut(u64),
) -> Result<VerifyReport, VerifyError> {
    let scene = scene_to_simulate(&log)?;
    let mut report = VerifyReport::new();
    if let Some(what) = compare_run(&log, &scene) {
        report.add(SnapshotFinding::in_file(what));
        return Ok(report);
    }
    let loaded = Solver::new(&scene);
    let mut reading = Reading::new(log, &loaded, options.range);
    let results = thread::scope(|threads| {
        let parts = Parts::start(threads, &loaded, options.threads, stop)?;
        reading.divide(parts, on_progress)
    })?;
    let has_started = !results.is_empty();
    report.add_parts(results);
    // When the first difference stops the reading depends on the threads, so a report of a difference
    // contains nothing from the rest of the file.
    if report.verdict == Verdict::Diverged {
        Ok(report)
    } else {
        reading.finish(has_started, report)
    }
}

/// A recording that is read and divided into parts.
#[derive(Debug)]
struct Reading<'a, R> {
    frames: FrameReader<R>,
    /// The scene at load.
    loaded: &'a Solver,
    range: StepRange,
    gaps: GapCounter,
    /// The steps of the snapshots before the first complete state.
    skipped: Option<StepGap>,
    skipped_count: u64,
    /// The recording goes on after the last step to compare.
    is_cut: bool,
    /// A difference that the reader has found, after all states before it.
    finding: Option<SnapshotFinding>,
    /// The error that ended the reading.
    error: Option<ReadError>,
    has_load: bool,
}

impl<'a, R: Read> Reading<'a, R> {
    fn new(log: LogReader<R>, loaded: &'a Solver, range: StepRange) -> Self {
        Self {
            gaps: GapCounter::for_selection(log.selection()),
            frames: FrameReader::new(log),
            loaded,
            range,
            skipped: None,
            skipped_count: 0,
            is_cut: false,
            finding: None,
            error: None,
            has_load: false,
        }
    }

    /// Reads the snapshots and passes them on, until a part differs. Returns the results of the parts, in order.
    fn divide(
        &mut self,
        mut parts: Parts,
        mut on_progress: impl FnMut(u64),
    ) -> Result<Vec<PartResult>, VerifyError> {
        let mut count: u64 = 0;
        while self.finding.is_none() {
            for particles in parts.spares() {
                self.frames.add_spare(particles);
            }
            let frame = match self.frames.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => break,
                Err(ReadError::Interrupted) => {
                    self.finding = Some(SnapshotFinding::Interrupted);
                    break;
                }
                Err(error) => {
                    self.error = Some(error);
                    break;
                }
            };
            count += 1;
            if count.is_multiple_of(SNAPSHOTS_PER_UPDATE) {
                on_progress(self.frames.log().intact_count());
            }
            if !self.pass_on(frame, &mut parts) {
                break;
            }
        }
        Ok(parts.finish()?)
    }

    /// Passes a snapshot on. Returns `false` if no more are needed.
    fn pass_on(&mut self, frame: Frame, parts: &mut Parts) -> bool {
        let step = frame.row.step;
        if step > self.range.last {
            self.is_cut = true;
            return false;
        }
        self.finding = self.check_load(&frame);
        if self.finding.is_some() {
            return false;
        }
        frame.updates.iter().for_each(|update| self.gaps.add(update));
        self.gaps.add_row(&frame.row);
        let is_start = step >= self.range.start && frame.is_complete_state();
        if !parts.has_begun() && !is_start {
            self.skipped_count += 1;
            self.skipped.get_or_insert(StepGap { from: step, to: step }).to = step;
            return true;
        }
        parts.add(frame)
    }

    /// Compares the messages on /topology and /surface with the constraints and triangles of the scene.
    fn check_load(&mut self, frame: &Frame) -> Option<SnapshotFinding> {
        let is_load = |one: &&Message| matches!(one, Message::Topology(_) | Message::Surface(_));
        let mut rows = frame.updates.iter().filter(is_load).peekable();
        rows.peek()?;
        let run = self.frames.log().run();
        let what = if std::mem::replace(&mut self.has_load, true) {
            Some("the messages on /topology and /surface are among its snapshots".to_owned())
        } else {
            rows.find_map(|row| compare_load(row, run, self.loaded))
                .or_else(|| compare_counts(run, self.loaded))
        };
        what.map(|what| SnapshotFinding::at_step(frame.row.step, what))
    }

    /// Completes the report with what the reader knows.
    fn finish(
        self,
        has_started: bool,
        mut report: VerifyReport,
    ) -> Result<VerifyReport, VerifyError> {
        if let Some(error) = self.error {
            return Err(error.into());
        }
        let log = self.frames.log();
        report.end = log.end().cloned();
        match self.finding {
            Some(finding) => report.add(finding),
            None if !has_started && self.is_cut => {
                return Err(VerifyError::NoStateUpTo { step: self.range.last });
            }
            None if !has_started => {
                return Err(VerifyError::NoKeyframe { end: report.incomplete_end().cloned() });
            }
            _ => {}
        }
        report.lost = self.gaps.lost(log.closing());
        report.skipped = self.skipped;
        let before = "before the state to start from";
        report.add_not_covered(self.skipped_count, "snapshot", before);
        if self.is_cut {
            let last = self.range.last;
            report
                .not_covered
                .push(format!("everything after step {last}, the last one to compare"));
        }
        let trailing_count = self.frames.trailing_updates().len() as u64;
        report.add_not_covered(trailing_count, "message", "after the last snapshot");
        Ok(report)
    }
}
