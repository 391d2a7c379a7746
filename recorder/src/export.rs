//! `recorder export`: pictures of a recording, to look at it without a viewer.

mod camera;
mod choice;
mod drawing;
mod extent;
mod font;
mod mesh;
mod moment;
mod png;
mod shape;
mod solids;
mod svg;
mod target;
#[cfg(test)]
mod tests;

use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use recorder::{Existing, FrameReader, LogEnd, LogReader, ReadError, RunDescription};
use serde::Serialize;
use sim_contract::Stop;
use sim_solver::Scene;
use sim_solver::scene::Up;

use crate::exit::Exit;
use crate::output::{self, AsJson};
use crate::scene_source::scene_of;
use camera::{Basis, Camera, View};
use choice::Choice;
use drawing::Easel;
use extent::Fit;
use mesh::Bend;
use shape::Size;
use target::{Format, Target};

/// Pictures of a call that says nothing of their number.
const FRAMES_DEFAULT: usize = 8;
/// Longest and shortest side of a picture, in pixels: 4 bytes each are held in memory.
const SIDE_MAX: u32 = 8192;
const SIDE_MIN: u32 = 16;

#[derive(Debug, clap::Args)]
#[command(
    group = clap::ArgGroup::new("format").required(true),
    group = clap::ArgGroup::new("choice"),
    after_help = "Draws colliders, surface triangles, constraints (structural dark, shear lighter, \
    bend dashed, tether dotted; torn ones not at all) and particles (pinned: red squares; grabbed \
    orange, anchored green, frozen magenta). All pictures of a call have the same scale.\n\n\
    Exit codes: 0 drawn; 1 failed; 3 the file is cut off or damaged, drawn as far as it \
    goes.\n\nExamples:\n  \
    recorder export run.mcap --png pictures\n  \
    recorder export run.mcap --png pictures --every 100ms --view front --size 1280x720\n  \
    recorder export run.mcap --svg pictures --at 1s --at 1500ms --overwrite"
)]
pub(crate) struct ExportArgs {
    /// Recording to draw
    file: PathBuf,
    /// Write PNG files into this folder, which is created: `NAME_STEP.png`
    #[arg(long, value_name = "DIR", group = "format")]
    png: Option<PathBuf>,
    /// Write SVG files into this folder, which is created: `NAME_STEP.svg`
    #[arg(long, value_name = "DIR", group = "format")]
    svg: Option<PathBuf>,
    /// Draw a picture at the start and after each of these simulated times, such as 500ms
    #[arg(long, value_name = "TIME", value_parser = period, group = "choice")]
    every: Option<Duration>,
    /// Draw so many pictures, evenly spread from the first to the last snapshot [default: 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), group = "choice")]
    frames: Option<u16>,
    /// Draw a picture this much simulated time after the first snapshot; can be repeated
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration, group = "choice")]
    at: Vec<Duration>,
    /// Width and height in pixels, 16 to 8192 each
    #[arg(long, value_name = "WxH", default_value = "960x720", value_parser = size)]
    size: Size,
    /// Side to look from [default: front in 2-D; along the axis in which the scene is flat; else
    /// iso]
    #[arg(long, value_enum)]
    view: Option<View>,
    /// Leave bending constraints out
    #[arg(long)]
    no_bend: bool,
    /// Replace files that exist [default: refuse, and write nothing]
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    as_json: AsJson,
}

/// One picture, as the user is told.
#[derive(Debug, Serialize)]
struct Drawn {
    file: String,
    step: u64,
    /// Simulated time since the first snapshot.
    time_s: f64,
}

/// How the pictures are meant to look.
#[derive(Debug, Clone, Copy)]
struct Look {
    size: Size,
    view: Option<View>,
    bend: Bend,
}

/// What is known of a recording once it has been read.
#[derive(Debug)]
struct Survey {
    run: RunDescription,
    /// Or why there is none to say what is up.
    scene: Result<Scene, String>,
    /// Of all snapshots, ascending.
    steps: Vec<u64>,
    end: LogEnd,
}

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let path = output::name_of(&args.file);
    let open = || LogReader::open(&args.file);
    let survey = Survey::of(open().with_context(|| path.clone())?, &path)?;
    let steps = args.choice().pick(&survey.steps, &survey.run).with_context(|| path.clone())?;
    if steps.is_empty() {
        bail!("{path}: has no snapshot to draw (the file is {})", survey.end);
    }
    if let Err(why) = &survey.scene {
        output::note(&format!("warning: {why}; drawn with y up"));
    }
    let target = args.target(&survey.run);
    target.prepare(&steps)?;
    let easel = easel(open, &survey, &steps, args.look()).with_context(|| path.clone())?;

    let mut drawn = Vec::new();
    moment::visit(open()?, &steps, |moment| {
        if stop.is_asked() {
            return Ok(ControlFlow::Break(()));
        }
        let step = moment.row.step;
        let time_s = survey.time_s(step);
        let file = target.write(step, &easel.draw(moment, time_s))?;
        drawn.push(Drawn { file: output::name_of(&file), step, time_s });
        Ok(ControlFlow::Continue(()))
    })
    .with_context(|| path.clone())?;

    let files: Vec<_> = drawn.iter().map(|one| one.file.as_str()).collect();
    output::result(args.as_json, &drawn, &files.join("\n"))?;
    if survey.end != LogEnd::Whole {
        output::note(&format!("warning: {path} is {}; drawn as far as it goes", survey.end));
    }
    let is_all = survey.end == LogEnd::Whole && drawn.len() == steps.len();
    Ok(if is_all { Exit::Done } else { Exit::Loss })
}

impl ExportArgs {
    fn choice(&self) -> Choice {
        match (self.every, self.frames) {
            (Some(period), _) => Choice::Every(period),
            (_, Some(count)) => Choice::Spread(count.into()),
            _ if !self.at.is_empty() => Choice::At(self.at.clone()),
            _ => Choice::Spread(FRAMES_DEFAULT),
        }
    }

    fn look(&self) -> Look {
        let bend = if self.no_bend { Bend::LeaveOut } else { Bend::Draw };
        Look { size: self.size, view: self.view, bend }
    }

    fn target(&self, run: &RunDescription) -> Target<'_> {
        let (folder, format) = match (&self.png, &self.svg) {
            (Some(folder), _) => (folder.as_path(), Format::Png),
            (None, folder) => (folder.as_deref().unwrap_or(Path::new(".")), Format::Svg),
        };
        let existing = if self.overwrite { Existing::Overwrite } else { Existing::Refuse };
        Target::new(folder, format, existing, &run.scene_name)
    }
}

impl Survey {
    /// Reads all of it, for its steps and how it ends.
    fn of<R: Read>(log: LogReader<R>, path: &str) -> anyhow::Result<Self> {
        let scene = scene_of(&log, path).map_err(|error| format!("{error:#}"));
        let run = log.run().clone();
        let mut frames = FrameReader::new(log);
        let mut steps = Vec::new();
        while let Some(frame) = frames.next_frame().with_context(|| path.to_owned())? {
            steps.push(frame.row.step);
        }
        let end = frames.end().cloned().unwrap_or(LogEnd::Whole);
        Ok(Self { run, scene, steps, end })
    }

    /// Simulated time from the first snapshot.
    fn time_s(&self, step: u64) -> f64 {
        let first = self.steps.first().copied().unwrap_or(step);
        step.saturating_sub(first) as f64 / f64::from(self.run.rate_hz)
    }
}

/// Reads what is to be drawn for the first time, so that one camera sees all of it.
fn easel<R: Read>(
    open: impl Fn() -> Result<LogReader<R>, ReadError>,
    survey: &Survey,
    steps: &[u64],
    look: Look,
) -> anyhow::Result<Easel> {
    let mut fit = Fit::default();
    moment::visit(open()?, steps, |moment| {
        fit.add(moment);
        Ok(ControlFlow::Continue(()))
    })?;
    let extent = fit.extent();
    let scene = survey.scene.as_ref().ok();
    let up = scene.map_or(Up::Y, |scene| scene.up);
    let is_2d = scene.is_some_and(|scene| scene.dimensions == 2);
    let found = || if is_2d { View::Front } else { View::of(&extent, up) };
    let view = look.view.unwrap_or_else(found);
    Ok(Easel {
        camera: Camera::fit(Basis::new(view, up), &extent, look.size),
        extent,
        size: look.size,
        bend: look.bend,
        scene_name: survey.run.scene_name.clone(),
    })
}

fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (SIDE_MIN..=SIDE_MAX).contains(side));
    let size = text
        .split_once('x')
        .and_then(|(width, height)| Some(Size { width: side(width)?, height: side(height)? }));
    size.ok_or_else(|| format!("not WIDTHxHEIGHT with sides from {SIDE_MIN} to {SIDE_MAX}"))
}

fn period(text: &str) -> Result<Duration, String> {
    match humantime::parse_duration(text) {
        Ok(Duration::ZERO) => Err("not longer than 0s".to_owned()),
        Ok(period) => Ok(period),
        Err(error) => Err(error.to_string()),
    }
}
