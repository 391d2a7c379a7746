//! `recorder export`: draws pictures of a recording.

#[cfg(test)]
mod tests;

use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use recorder::{ContentSelection, FrameReader, LogEnd, LogReader, ReadError, RunDescription};
use serde::Serialize;
use sim_contract::Stop;
use sim_solver::Scene;
use sim_solver::scene::Up;

use crate::cli::exit::Exit;
use crate::cli::file_args::OverwriteArgs;
use crate::cli::output::{self, AsJson};
use crate::cli::parse::{self, whole_number_in};
use crate::export::pictures::camera::{Basis, Camera, View};
use crate::export::pictures::extent::ExtentTracker;
use crate::export::pictures::mesh::Bend;
use crate::export::pictures::renderer::Renderer;
use crate::export::pictures::shape::Size;
use crate::export::pictures::target::{Format, Target};
use crate::export::scene_state::visit_states;
use crate::export::selection::Selection;
use crate::input::scene_source::scene_in_recording;

/// Number of pictures without an option that selects them.
const FRAMES_DEFAULT: usize = 8;
/// Most snapshots of a recording to draw: 19 hours at 240 Hz. Their steps take 128 MiB of memory.
const SNAPSHOTS_MAX: usize = 1 << 24;
/// Longest and shortest side of a picture, in pixels. A picture takes 4 bytes of memory per pixel.
const SIDE_MAX: u32 = 8192;
const SIDE_MIN: u32 = 16;

#[derive(Debug, clap::Args)]
#[command(
    group = clap::ArgGroup::new("format").required(true),
    group = clap::ArgGroup::new("selection"),
    after_help = "Draws colliders, surface triangles, constraints (structural dark, shear lighter, \
    bend dashed, tether dotted; torn ones are left out) and particles (pinned: red squares; grabbed \
    orange, anchored green, frozen magenta). All pictures of a call have the same scale.\n\n\
    Exit codes: 0 drawn; 1 failed; 3 the file is truncated or damaged and was drawn as far as it \
    goes.\n\nExamples:\n  \
    recorder export run.mcap --png pictures\n  \
    recorder export run.mcap --png pictures --every 100ms --view front --size 1280x720\n  \
    recorder export run.mcap --svg pictures --at 1s --at 1500ms --overwrite"
)]
pub(crate) struct ExportArgs {
    /// Recording to draw
    file: PathBuf,
    /// Write PNG files named `NAME_STEP.png` into this folder. Creates the folder
    #[arg(long, value_name = "DIR", group = "format")]
    png: Option<PathBuf>,
    /// Write SVG files named `NAME_STEP.svg` into this folder. Creates the folder
    #[arg(long, value_name = "DIR", group = "format")]
    svg: Option<PathBuf>,
    /// Draw a picture at the start and after each period of simulated time, such as 500ms
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = period, group = "selection")]
    every: Option<Duration>,
    /// Draw N pictures, evenly spaced from the first to the last snapshot [default: 8]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = frames, group = "selection")]
    frames: Option<usize>,
    /// Draw a picture at this simulated time after the first snapshot. Can be repeated
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse::duration, group = "selection")]
    at: Vec<Duration>,
    /// Width and height in pixels, 16 to 8192 each
    #[arg(long, value_name = "WxH", default_value = "960x720", allow_hyphen_values = true, value_parser = size)]
    size: Size,
    /// Direction of view [default: front for a 2-D scene, along the thin axis of a flat scene, else
    /// iso]
    #[arg(long, value_enum)]
    view: Option<View>,
    /// Leave out bend constraints
    #[arg(long)]
    no_bend: bool,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// A written picture, as printed.
#[derive(Debug, Serialize)]
struct WrittenPicture {
    file: String,
    step: u64,
    /// Simulated time since the first snapshot.
    time_s: f64,
}

/// The options that control the appearance of the pictures.
#[derive(Debug, Clone, Copy)]
struct Style {
    size: Size,
    view: Option<View>,
    bend: Bend,
}

/// The properties of a recording that the drawing needs.
#[derive(Debug)]
struct Survey {
    run: RunDescription,
    /// The scene, which gives the up axis, or the reason why there is none.
    scene: Result<Scene, String>,
    /// Steps of all snapshots, ascending.
    steps: Vec<u64>,
    end: LogEnd,
}

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let path = output::path_text(&args.file);
    let open = || LogReader::open_until(&args.file, &stop);
    let log = open().with_context(|| path.clone())?;
    let needed = log.selection().require(&ContentSelection::FOR_PICTURES, "`recorder export`");
    needed.with_context(|| path.clone())?;
    let needed = log.selection().require_all_particles("`recorder export`");
    needed.with_context(|| path.clone())?;
    let survey = Survey::read(log, &path)?;
    let selection = args.selection();
    let steps =
        selection.select(&survey.steps, survey.run.rate_hz).with_context(|| path.clone())?;
    if steps.is_empty() {
        bail!("{path}: has no snapshot to draw (the file is {})", survey.end);
    }
    if let Err(reason) = &survey.scene {
        output::note(&format!("warning: {reason}; drawn with y up"));
    }
    let target = args.target(&survey.run);
    target.prepare(&steps)?;
    let renderer = renderer(open, &survey, &steps, args.style()).with_context(|| path.clone())?;

    let mut written = Vec::new();
    visit_states(open()?, &steps, |state| {
        if stop.is_requested() {
            return Ok(ControlFlow::Break(()));
        }
        let step = state.row.step;
        let time_s = survey.time_s(step);
        let file = target.write(step, &renderer.draw(state, time_s))?;
        written.push(WrittenPicture { file: output::path_text(&file), step, time_s });
        Ok(ControlFlow::Continue(()))
    })
    .with_context(|| path.clone())?;

    let files: Vec<_> = written.iter().map(|picture| picture.file.as_str()).collect();
    output::result(args.as_json, &written, &files.join("\n"))?;
    if survey.end != LogEnd::Complete {
        output::warn_incomplete(&args.file, &survey.end, "drawn as far as it goes");
    }
    let is_complete = survey.end == LogEnd::Complete && written.len() == steps.len();
    Ok(if is_complete { Exit::Done } else { Exit::Loss })
}

impl ExportArgs {
    fn selection(&self) -> Selection {
        match (self.every, self.frames) {
            (Some(period), _) => Selection::Every(period),
            (_, Some(count)) => Selection::Spread(count),
            _ if !self.at.is_empty() => Selection::At(self.at.clone()),
            _ => Selection::Spread(FRAMES_DEFAULT),
        }
    }

    fn style(&self) -> Style {
        let bend = if self.no_bend { Bend::Hide } else { Bend::Draw };
        Style { size: self.size, view: self.view, bend }
    }

    fn target(&self, run: &RunDescription) -> Target<'_> {
        let (folder, format) = match (&self.png, &self.svg) {
            (Some(folder), _) => (folder.as_path(), Format::Png),
            (None, folder) => (folder.as_deref().unwrap_or(Path::new(".")), Format::Svg),
        };
        Target::new(folder, format, self.overwrite.existing(), &run.scene_name)
    }
}

impl Survey {
    /// Reads the whole recording for its steps and its end.
    fn read<R: Read>(log: LogReader<R>, path: &str) -> anyhow::Result<Self> {
        let scene = scene_in_recording(&log).map_err(|error| format!("{path}: {error:#}"));
        let run = log.run().clone();
        let mut frames = FrameReader::new(log);
        let mut steps = Vec::new();
        while let Some(frame) = frames.next_frame().with_context(|| path.to_owned())? {
            if steps.len() == SNAPSHOTS_MAX {
                bail!("{path}: has more than {SNAPSHOTS_MAX} snapshots");
            }
            steps.push(frame.row.step);
        }
        let end = frames.end().cloned().unwrap_or(LogEnd::Complete);
        Ok(Self { run, scene, steps, end })
    }

    /// Returns the simulated time since the first snapshot.
    fn time_s(&self, step: u64) -> f64 {
        let first = self.steps.first().copied().unwrap_or(step);
        step.saturating_sub(first) as f64 / f64::from(self.run.rate_hz)
    }
}

/// Reads the selected states once, so that one camera shows all of them.
fn renderer<R: Read>(
    open: impl Fn() -> Result<LogReader<R>, ReadError>,
    survey: &Survey,
    steps: &[u64],
    style: Style,
) -> anyhow::Result<Renderer> {
    let mut tracker = ExtentTracker::default();
    visit_states(open()?, steps, |state| {
        tracker.add(state);
        Ok(ControlFlow::Continue(()))
    })?;
    let extent = tracker.extent();
    let scene = survey.scene.as_ref().ok();
    let up = scene.map_or(Up::Y, |scene| scene.up);
    let is_2d = scene.is_some_and(|scene| scene.dimensions == 2);
    let default_view = || if is_2d { View::Front } else { View::best_for(&extent, up) };
    let view = style.view.unwrap_or_else(default_view);
    Ok(Renderer {
        camera: Camera::fit(Basis::new(view, up), &extent, style.size),
        extent,
        size: style.size,
        bend: style.bend,
        scene_name: survey.run.scene_name.clone(),
    })
}

fn frames(text: &str) -> Result<usize, String> {
    let count = whole_number_in(text, &(1..=65_535))?;
    usize::try_from(count).map_err(|error| error.to_string())
}

fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (SIDE_MIN..=SIDE_MAX).contains(side));
    let size = text
        .split_once('x')
        .and_then(|(width, height)| Some(Size { width: side(width)?, height: side(height)? }));
    size.ok_or_else(|| format!("it must be WIDTHxHEIGHT with sides from {SIDE_MIN} to {SIDE_MAX}"))
}

fn period(text: &str) -> Result<Duration, String> {
    match parse::duration(text)? {
        Duration::ZERO => Err("it must be a time longer than 0s".to_owned()),
        period => Ok(period),
    }
}
