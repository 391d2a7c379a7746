//! `recorder diff`: shows where two recordings come apart, and how their distance grows.

mod report;

use std::cmp::Ordering;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recording::verification::{SnapshotDifference, snapshot_difference};
use recording::{FileSource, Frame, FrameReader, LogEnd, LogReader, Message, OutcomeRow};
use serde_json::Value;
use sim_contract::{Action, ParticleState};
use sim_host::Stop;

use crate::cli::damaged_input::lacks;
use crate::cli::output::{self, AsJson, Exit, progress_spinner};
use report::{CommandDifference, DiffReport, Distance, Growth, SceneDifference, StateDifference};

/// Compared steps between two updates of the progress.
const STEPS_PER_UPDATE: u64 = 256;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Compares the scenes, the commands that act on states, and every bit of the particles in the steps that both \
    files have. The distance of two states is the greatest distance of a particle's two positions.\n\n\
    Exit codes: 0 equal in all common steps; 1 failed, or different numbers of particles; 3 different, or a file truncated or damaged.\n\nExamples:\n  \
    recorder diff run.mcap changed.mcap\n  \
    recorder diff run.mcap changed.mcap --json"
)]
pub(crate) struct DiffArgs {
    /// First recording
    a: PathBuf,
    /// Second recording
    b: PathBuf,
    #[command(flatten)]
    as_json: AsJson,
}

pub(crate) fn run(args: &DiffArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let (a, b) = (open(&args.a, &stop)?, open(&args.b, &stop)?);
    let bar = progress_spinner();
    let mut comparison = Comparison::new(a, b);
    let ends = comparison.run(|step| {
        if step.is_multiple_of(STEPS_PER_UPDATE) {
            bar.set_message(format!("step {step}"));
        }
    })?;
    bar.finish_and_clear();
    let paths = [&args.a, &args.b];
    let report = comparison.report().map_err(|error| {
        let damaged = paths.into_iter().zip(&ends).find(|(_, end)| **end != LogEnd::Complete);
        match damaged {
            Some((path, end)) => lacks(path, &format!("{error:#}"), Some(end)),
            None => error,
        }
    })?;
    output::result(args.as_json, &report, &report.to_string())?;
    let mut is_complete = true;
    for (path, end) in paths.into_iter().zip(ends) {
        if end != LogEnd::Complete {
            output::warn_of_losses(path, &end, "compared as far as it goes", &stop);
            is_complete = false;
        }
    }
    Ok(if report.first.is_none() && is_complete { Exit::Done } else { Exit::Loss })
}

/// Opens a recording with the content that a comparison needs.
fn open(path: &Path, stop: &Stop) -> anyhow::Result<FrameReader<FileSource>> {
    let opened = || -> anyhow::Result<_> {
        let log = LogReader::open_until(path, stop)?;
        log.selection().require_all_particles("`recorder diff`")?;
        Ok(FrameReader::new(log))
    };
    opened().with_context(|| output::path_text(path))
}

/// One of the two recordings.
struct Side {
    frames: FrameReader<FileSource>,
    frame: Option<Frame>,
    /// Commands that act on states, up to the current snapshot, that are not compared yet.
    commands: VecDeque<OutcomeRow>,
    /// First and last step.
    steps: Option<(u64, u64)>,
}

impl Side {
    fn new(frames: FrameReader<FileSource>) -> Self {
        Self { frames, frame: None, commands: VecDeque::new(), steps: None }
    }

    /// Reads the next snapshot.
    fn advance(&mut self) -> anyhow::Result<()> {
        self.frame = self.frames.next_frame()?;
        let Some(frame) = &self.frame else { return Ok(()) };
        let step = frame.row.step;
        self.steps = Some((self.steps.map_or(step, |(first, _)| first), step));
        self.commands.extend(frame.updates.iter().filter_map(command));
        Ok(())
    }

    /// Reads the snapshots that the other recording does not have at its end.
    fn read_rest(&mut self) -> anyhow::Result<()> {
        while self.frame.is_some() {
            self.advance()?;
            // There is nothing to compare them with.
            self.commands.clear();
        }
        Ok(())
    }

    fn step(&self) -> Option<u64> {
        self.frame.as_ref().map(|frame| frame.row.step)
    }

    fn particles(&self) -> &[ParticleState] {
        self.frame.as_ref().map(Frame::payload).unwrap_or_default()
    }

    /// Drops the commands up to a step, which is before the first common one.
    fn skip_commands(&mut self, step: u64) {
        self.commands.retain(|row| row.step > step);
    }

    fn end(&self) -> LogEnd {
        self.frames.end().cloned().unwrap_or(LogEnd::Complete)
    }
}

/// Returns the outcome of a command that acts on states. Those that only pace a node do not.
fn command(update: &Message) -> Option<OutcomeRow> {
    match update {
        Message::Outcome(row) => {
            let is_pace =
                matches!(row.action, Action::Pause | Action::Resume | Action::Step { .. });
            (!is_pace).then(|| row.clone())
        }
        _ => None,
    }
}

/// The comparison of two recordings.
struct Comparison {
    a: Side,
    b: Side,
    rate_hz: u32,
    report: DiffReport,
    growth: Growth,
}

impl Comparison {
    fn new(a: FrameReader<FileSource>, b: FrameReader<FileSource>) -> Self {
        let scene = scene_difference(a.log().scene(), b.log().scene());
        let rate_hz = a.log().run().rate_hz;
        let report =
            DiffReport { first: scene.as_ref().map(|_| "scene"), scene, ..DiffReport::default() };
        let (a, b) = (Side::new(a), Side::new(b));
        Self { a, b, rate_hz, report, growth: Growth::default() }
    }

    /// Compares all steps that both have. Calls `on_step` after each. Returns the ends of the files.
    fn run(&mut self, mut on_step: impl FnMut(u64)) -> anyhow::Result<[LogEnd; 2]> {
        self.a.advance().context("the first file")?;
        self.b.advance().context("the second file")?;
        while let (Some(a), Some(b)) = (self.a.step(), self.b.step()) {
            if a == b {
                self.compare(a)?;
                on_step(a);
            }
            if a.cmp(&b) != Ordering::Greater {
                self.a.advance().context("the first file")?;
            }
            if b.cmp(&a) != Ordering::Greater {
                self.b.advance().context("the second file")?;
            }
        }
        for (side, name) in [(&mut self.a, "the first file"), (&mut self.b, "the second file")] {
            side.read_rest().context(name)?;
        }
        Ok([self.a.end(), self.b.end()])
    }

    fn compare(&mut self, step: u64) -> anyhow::Result<()> {
        if self.report.first_step.is_none() {
            self.report.first_step = Some(step);
            // The first state has the effect of those before it.
            self.a.skip_commands(step);
            self.b.skip_commands(step);
        }
        self.report.last_step = Some(step);
        self.report.common_steps += 1;
        let (count_a, count_b) = (self.a.particles().len(), self.b.particles().len());
        if count_a != count_b {
            bail!(
                "the files have {count_a} and {count_b} particles, so their states cannot be compared"
            );
        }
        self.compare_commands(step);
        let state = self.state_difference(step);
        if state.is_some() {
            self.report.different_steps += 1;
        }
        if self.report.state.is_none() {
            self.report.state = state;
            let is_first = self.report.state.is_some() && self.report.first.is_none();
            self.report.first = self.report.first.or(is_first.then_some("state"));
        }
        if self.report.state.is_some() {
            let (a, b) = (self.a.particles(), self.b.particles());
            self.growth.add(Distance::new(step, self.rate_hz, a, b));
        }
        Ok(())
    }

    /// Compares the commands up to a step in their order. The first difference ends the comparison.
    fn compare_commands(&mut self, step: u64) {
        loop {
            let is_due = |side: &Side| side.commands.front().is_some_and(|row| row.step <= step);
            let (has_a, has_b) = (is_due(&self.a), is_due(&self.b));
            let a = if has_a { self.a.commands.pop_front() } else { None };
            let b = if has_b { self.b.commands.pop_front() } else { None };
            let steps = a.iter().chain(&b).map(|row| row.step);
            let Some(step) = steps.min() else { return };
            let [a, b] = [a, b].map(|row| row.map(|row| json(&row)));
            if self.report.commands.is_none() && a != b {
                self.report.commands = Some(CommandDifference { step, a, b });
                self.report.first = self.report.first.or(Some("commands"));
            }
        }
    }

    fn state_difference(&self, step: u64) -> Option<StateDifference> {
        let (a, b) = (self.a.frame.as_ref()?, self.b.frame.as_ref()?);
        Some(match snapshot_difference(a, b)? {
            SnapshotDifference::Particle(found) => StateDifference {
                step,
                particle: Some(found.particle),
                field: found.field,
                a: found.recorded,
                b: found.simulated,
            },
            SnapshotDifference::TornConstraints => StateDifference {
                step,
                particle: None,
                field: "the torn constraints, state hash",
                a: format!("{:016x}", a.row.state_hash),
                b: format!("{:016x}", b.row.state_hash),
            },
        })
    }

    fn report(mut self) -> anyhow::Result<DiffReport> {
        if self.report.common_steps == 0 {
            let text = |side: &Side| {
                side.steps.map_or("none".to_owned(), |(first, last)| format!("{first}..={last}"))
            };
            bail!(
                "no step is in both files: the first has {}, the second {}",
                text(&self.a),
                text(&self.b)
            );
        }
        (self.report.steps_of_a, self.report.steps_of_b) = (self.a.steps, self.b.steps);
        self.report.growth = self.growth.rows();
        self.report.greatest = self.growth.greatest;
        Ok(self.report)
    }
}

/// A command without its numbers. Its status shows whether its client had the right to it.
fn json(row: &OutcomeRow) -> Value {
    let mut value = serde_json::to_value(row).unwrap_or_default();
    if let Some(fields) = value.as_object_mut() {
        for name in ["index", "client_id", "sequence"] {
            fields.remove(name);
        }
    }
    value
}

fn scene_difference(a: &[u8], b: &[u8]) -> Option<SceneDifference> {
    if a == b {
        return None;
    }
    let [a, b] = [a, b].map(String::from_utf8_lossy);
    let (mut lines_a, mut lines_b) = (a.lines(), b.lines());
    for line in 1.. {
        let (a, b) = (lines_a.next(), lines_b.next());
        if a != b || a.is_none() {
            let text = |line: Option<&str>| line.unwrap_or("(end)").to_owned();
            return Some(SceneDifference { line, a: text(a), b: text(b) });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_different_line_of_two_scenes_is_named() {
        assert_eq!(scene_difference(b"a\nb", b"a\nb"), None);
        let difference = scene_difference(b"a\nb\nc", b"a\nb").unwrap();
        assert_eq!((difference.line, &*difference.a, &*difference.b), (3, "c", "(end)"));
        assert_eq!(scene_difference(b"a\nb", b"a\nc").unwrap().line, 2);
    }
}
