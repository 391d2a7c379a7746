//! Simulates a recording again and writes it with the particles of every snapshot.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use anyhow::{Context, bail};
use recording::simulation::SimulationResult;
use recording::verification::{Resimulation, SnapshotFinding};
use recording::{
    Closing, ContentSelection, Frame, FrameReader, LogEnd, LogOptions, LogReader, LogWriter,
    Message, ReadError, SceneColliders, Topic, WriteError, scene_to_simulate,
};
use sim_solver::Scene;

use crate::cli::damaged_input::lacks;

/// The result of a completion.
#[derive(Debug)]
pub(super) struct Completed {
    pub(super) scene: Scene,
    pub(super) first_step: u64,
    pub(super) result: SimulationResult,
    /// The end of the input.
    pub(super) end: LogEnd,
    pub(super) is_interrupted: bool,
}

/// The place of an error in the output.
const OUTPUT: &str = "the new file, whose readable part ends with .part";

/// A recording that is simulated again.
pub(super) struct Completion<R: Read> {
    path: PathBuf,
    frames: FrameReader<R>,
    scene: Scene,
    simulation: Option<Resimulation>,
    threads: usize,
    first_step: Option<u64>,
    result: SimulationResult,
}

impl<R: Read> Completion<R> {
    /// Starts with a recording that has its commands and keyframes.
    pub(super) fn new(path: &Path, log: LogReader<R>, threads: usize) -> anyhow::Result<Self> {
        let scene = scene_to_simulate(&log)?;
        Ok(Self {
            path: path.to_owned(),
            frames: FrameReader::new(log),
            scene,
            simulation: None,
            threads,
            first_step: None,
            result: SimulationResult::default(),
        })
    }

    /// Writes the complete recording to what `create` returns, if that is a file. Ends early if `stop`
    /// becomes true. Calls `on_step` after each snapshot.
    pub(super) fn run<W: Write>(
        mut self,
        options: LogOptions,
        create: impl FnOnce() -> anyhow::Result<Option<W>>,
        stop: &AtomicBool,
        mut on_step: impl FnMut(u64),
    ) -> anyhow::Result<(Completed, Option<W>)> {
        let mut is_interrupted = false;
        let mut next = self.next_frame(&mut is_interrupted)?;
        let first_time_ns = next.as_ref().and_then(|frame| frame.log_times_ns.first().copied());
        let mut out = match create()? {
            Some(out) => {
                Some(self.begin(out, options, first_time_ns.unwrap_or(0)).context(OUTPUT)?)
            }
            None => None,
        };
        while let Some(frame) = next {
            if !self.advance(&frame, stop)? {
                is_interrupted = true;
                break;
            }
            if let Some(out) = &mut out {
                self.write(out, &frame).context(OUTPUT)?;
            }
            on_step(frame.row.step);
            next = self.next_frame(&mut is_interrupted)?;
        }
        if let (Some(out), false) = (&mut out, is_interrupted) {
            self.write_trailing(out).context(OUTPUT)?;
        }
        let finish = |out: LogWriter<W>| {
            let closing = self.closing(&out, is_interrupted);
            out.finish(&closing)
        };
        let out = out.map(finish).transpose().context(OUTPUT)?;
        Ok((self.completed(is_interrupted)?, out))
    }

    /// Returns the next snapshot; `None` after a signal, too.
    fn next_frame(&mut self, is_interrupted: &mut bool) -> Result<Option<Frame>, ReadError> {
        match self.frames.next_frame() {
            Err(ReadError::Interrupted) => {
                *is_interrupted = true;
                Ok(None)
            }
            frame => frame,
        }
    }

    fn begin<W: Write>(
        &self,
        out: W,
        options: LogOptions,
        log_time_ns: u64,
    ) -> Result<LogWriter<W>, WriteError> {
        let log = self.frames.log();
        let selection = ContentSelection { is_only_commands: false, ..log.selection() };
        let options = LogOptions { selection, ..options };
        let mut out = LogWriter::create(out, options, log.run(), log.scene(), log_time_ns)?;
        out.describe_colliders(&SceneColliders::new(&self.scene))?;
        Ok(out)
    }

    /// Simulates up to a snapshot and compares everything that the recording has of it. Returns `false`
    /// after a signal.
    fn advance(&mut self, frame: &Frame, stop: &AtomicBool) -> anyhow::Result<bool> {
        let finding = match &mut self.simulation {
            Some(simulation) => simulation.advance(frame, stop),
            None => match Resimulation::start(&self.scene, frame)? {
                Some(mut start) => {
                    start.set_threads(self.threads);
                    self.simulation.insert(start).compare_start(frame)
                }
                None if frame.particles.is_some() => SnapshotFinding::Identical,
                None => bail!(
                    "step {} has no particles, and no keyframe before it to start from",
                    frame.row.step
                ),
            },
        };
        if finding == SnapshotFinding::Interrupted {
            return Ok(false);
        }
        finding.require_identical()?;
        self.first_step.get_or_insert(frame.row.step);
        (self.result.steps, self.result.state_hash) = (frame.row.step, frame.row.state_hash);
        for update in &frame.updates {
            if let Message::Outcome(row) = update {
                let is_applied = row.is_applied();
                self.result.applied_count += u64::from(is_applied);
                self.result.rejected_count += u64::from(!is_applied);
            }
        }
        Ok(true)
    }

    fn write<W: Write>(&self, out: &mut LogWriter<W>, frame: &Frame) -> Result<(), WriteError> {
        let mut times_ns = frame.log_times_ns.iter().copied();
        let mut time_ns = move || times_ns.next().unwrap_or(0);
        for update in &frame.updates {
            out.write(update, time_ns())?;
        }
        let row_time_ns = time_ns();
        let step = frame.row.step;
        out.write(&Message::Step(frame.row), row_time_ns)?;
        let simulated = || self.simulation.as_ref().map(|one| one.particles().to_vec());
        let particles = frame.particles.clone().or_else(simulated).unwrap_or_default();
        out.write(&Message::Particles { step, particles }, row_time_ns)
    }

    /// Writes the messages after the last snapshot. A header without particles is at the end of a
    /// truncated file.
    fn write_trailing<W: Write>(&self, out: &mut LogWriter<W>) -> Result<(), WriteError> {
        if self.frames.trailing_row().is_some() {
            return Ok(());
        }
        let times_ns = self.frames.trailing_log_times_ns();
        let mut updates = self.frames.trailing_updates().iter().zip(times_ns);
        updates.try_for_each(|(update, time_ns)| out.write(update, *time_ns))
    }

    /// Returns the end of the new file: that of the recording, with the particles that were added.
    fn closing<W: Write>(&self, out: &LogWriter<W>, is_interrupted: bool) -> Closing {
        let (written, recorded) = (*out.counts(), self.frames.log().closing());
        let stop_reason = match recorded {
            _ if is_interrupted => "interrupted",
            Some(recorded) => &recorded.stop_reason,
            None => "end of the readable part",
        };
        let stop_reason = stop_reason.to_owned();
        let mut closing = Closing { stop_reason, ..recorded.cloned().unwrap_or_default() };
        let is_completed = self.frames.log().selection().is_only_commands;
        closing.counts.set_written(&written);
        if is_completed {
            closing.counts[Topic::Particles].left_out = 0;
        }
        if recorded.is_none() {
            closing.counts.set_received_to_written();
        }
        closing
    }

    fn completed(self, is_interrupted: bool) -> anyhow::Result<Completed> {
        let lacks_states = || lacks(&self.path, "has no snapshot", self.frames.end());
        let first_step = self.first_step.ok_or_else(lacks_states)?;
        Ok(Completed {
            scene: self.scene,
            first_step,
            result: self.result,
            end: self.frames.end().cloned().unwrap_or(LogEnd::Complete),
            is_interrupted,
        })
    }
}
