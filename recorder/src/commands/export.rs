//! `recorder export`: turns a recording into files of other programs.

mod data;
mod files;
mod format_args;
mod foxglove;
mod npz;
mod obj;
mod pictures;
mod ros2;
mod selection;
mod shapes;
mod snapshots;
mod survey;
mod tables;
#[cfg(test)]
mod tests;
mod usda;
mod vtk;

use std::io::{BufReader, Read};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use clap::error::ErrorKind;
use recording::pictures::{Bend, PictureOptions, Size, Style, View};
use recording::{
    IntactParts, LogEnd, LogReader, ReadError, SceneState, SceneStates, open_regular_file,
};
use sim_host::Stop;

use crate::cli::args::{OverwriteArgs, refuse_own_input};
use crate::cli::damaged_input::{intact_parts, lacks};
use crate::cli::output::{self, AsJson, Exit, progress_bar, progress_bytes};
use crate::cli::parse::{self, whole_number_in};
use data::DataFormat;
use files::{FrameNames, Target};
use format_args::{Format, FormatArgs};
use pictures::FramePace;
use selection::{Choice, Moment, Selection, SnapshotRange};
use snapshots::{OpenBytes, Snapshots};
use survey::Survey;

/// Number of pictures without an option that selects them.
const FRAMES_DEFAULT: usize = 8;
/// Bytes that a file is read ahead.
const BUFFER_SIZE_BYTES: usize = 1 << 18;
/// Simulated time between two messages on `/scene`.
const SCENE_PERIOD: Duration = Duration::from_nanos(33_333_333);
/// Longest and shortest side of a picture, in pixels. A picture takes 4 bytes of memory per pixel.
const SIDE_MAX: u32 = 8192;
const SIDE_MIN: u32 = 16;
const SIZE_DEFAULT: Size = Size { width: 960, height: 720 };
const FRAMES_PER_S_DEFAULT: u16 = 25;

#[derive(Debug, clap::Args)]
#[command(
    group = clap::ArgGroup::new("selection"),
    after_help = "Pictures of the style wires show colliders, surface triangles, constraints (structural dark, shear \
    lighter, bend dashed, tether dotted; torn ones are left out) and particles (pinned: red squares; \
    grabbed orange, anchored green, frozen magenta), and of the style shaded surfaces without them \
    and without a caption, each triangle in one shade. All \
    pictures of a call have the same scale. \
    Without an option that selects snapshots there are 8 of them; other formats have every \
    snapshot.\n\n\
    Coordinates are those of the recording, in m, relative to the origin of the scene: no format \
    turns the scene.\n\n\
    `-` as the FILE of --apng, --npz, --csv, --energy, --usda and --foxglove is stdout. The line about the result is then on \
    stderr.\n\n\
    Exit codes: 0 exported; 1 failed; 3 the file is truncated or damaged, and what is intact was \
    exported, if anything is.\n\nExamples:\n  \
    recorder export run.mcap --png pictures\n  \
    recorder export run.mcap --png pictures --every 100ms --view front --size 1280x720\n  \
    recorder export run.mcap --svg pictures --at 1s --at 1500ms --overwrite\n  \
    recorder export run.mcap --apng run.png --to 5s --size 480x360 --style shaded\n  \
    recorder export run.mcap --usda run.usda --fps 25\n  \
    recorder export run.mcap --npz run.npz --from 2s --to 5s"
)]
pub(crate) struct ExportArgs {
    /// Recording to export
    file: PathBuf,
    #[command(flatten)]
    format: FormatArgs,
    /// Begin here: a step such as 480, or a simulated time after the first snapshot such as 2s
    #[arg(long, value_name = "STEP|TIME", allow_hyphen_values = true, value_parser = moment)]
    from: Option<Moment>,
    /// End here, inclusive: a step or a simulated time
    #[arg(long, value_name = "STEP|TIME", allow_hyphen_values = true, value_parser = moment)]
    to: Option<Moment>,
    /// Export a snapshot at the start and after each period of simulated time, such as 500ms
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = period, group = "selection")]
    every: Option<Duration>,
    /// Export N snapshots, evenly spaced from the first to the last one
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = frames, group = "selection")]
    frames: Option<usize>,
    /// Export a snapshot at this simulated time after the first one. Can be repeated
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse::duration,
        group = "selection", conflicts_with_all = ["from", "to"])]
    at: Vec<Duration>,
    /// Frames per second, 1 to 100: of an animation [default: 25], or of the simulated time in --obj, --vtk,
    /// --pc2 and --usda, whose frames are interpolated between the snapshots around them
    #[arg(long, value_name = "FPS", allow_hyphen_values = true, value_parser = frames_per_s)]
    fps: Option<u16>,
    /// Width and height of pictures in pixels, 16 to 8192 each [default: 960x720]
    #[arg(long, value_name = "WxH", allow_hyphen_values = true, value_parser = size)]
    size: Option<Size>,
    /// Direction of view of pictures [default: front for a 2-D scene, along the thin axis of a flat
    /// scene, else iso]
    #[arg(long, value_enum)]
    view: Option<ViewArg>,
    /// Appearance of pictures [default: wires]
    #[arg(long, value_enum)]
    style: Option<StyleArg>,
    /// Leave bend constraints out of pictures
    #[arg(long)]
    no_bend: bool,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// Direction of view of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ViewArg {
    /// Along the depth axis, with x to the right and the scene's up axis up
    Front,
    /// From the right-hand side of the front view
    Side,
    /// From above
    Top,
    /// Oblique: turned by 30 degrees, from 20 degrees above
    Iso,
}

impl From<ViewArg> for View {
    fn from(view: ViewArg) -> Self {
        match view {
            ViewArg::Front => Self::Front,
            ViewArg::Side => Self::Side,
            ViewArg::Top => Self::Top,
            ViewArg::Iso => Self::Iso,
        }
    }
}

/// Appearance of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum StyleArg {
    /// Particles, constraints and triangles
    Wires,
    /// Surfaces, each triangle in one shade, and, where there is no surface, structural constraints and loose particles
    Shaded,
}

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<Exit> {
    args.check().unwrap_or_else(|error| output::with_usage(&error));
    let stop = Stop::install()?;
    let path = output::path_text(&args.file);
    let open = || LogReader::open_until(&args.file, &stop);
    let log = open().with_context(|| path.clone())?;
    let needed = log.selection().require_all_particles("`recorder export`");
    needed.with_context(|| path.clone())?;
    let format = args.format.format().context("one of the formats is required")?;
    output::warn_of_extension(format.target(), format.extensions());
    refuse_own_input(&open_regular_file(&args.file)?, format.target())?;
    let mut survey = survey(args, log, &path)?;
    let saves_more = |parts: &IntactParts| parts.snapshot_count() > survey.steps.len() as u64;
    let parts = intact_parts(&args.file, &survey.end, &stop, saves_more)?;
    if let Some(parts) = &parts {
        let end = survey.end;
        survey = Survey::read(parts.reader()?, &path, |_| {})?;
        survey.end = end;
    }
    if let Format::Data(DataFormat::Ros2, folder) = format {
        let names = FrameNames::new(folder, &survey.run.scene_name, "mcap");
        refuse_own_input(&open_regular_file(&args.file)?, &names.index_path("mcap"))?;
    }
    let selection = args.selection(&format);
    let steps =
        selection.select(&survey.steps, survey.run.rate_hz).with_context(|| path.clone())?;
    if steps.is_empty() {
        // The selection is not empty where the file has snapshots.
        return Err(lacks(&args.file, "has no snapshot to export", Some(&survey.end)))
            .context(path);
    }
    if let Some(warning) = survey.warning() {
        output::note(&warning);
    }
    let done = match &parts {
        None => {
            let file = || open_regular_file(&args.file);
            let bytes = || Ok(boxed(file()?.take(survey.intact_count)));
            export(args, &survey, &steps, &format, open, &bytes)?;
            "exported as far as it goes"
        }
        Some(parts) => {
            let bytes = || Ok(boxed(parts.bytes()?));
            export(args, &survey, &steps, &format, || parts.reader(), &bytes)?;
            "exported what is intact"
        }
    };
    if survey.end == LogEnd::Complete {
        return Ok(Exit::Done);
    }
    output::warn_incomplete(&args.file, &survey.end, done);
    Ok(Exit::Loss)
}

fn boxed(bytes: impl Read + 'static) -> Box<dyn Read> {
    Box::new(BufReader::with_capacity(BUFFER_SIZE_BYTES, bytes))
}

/// Reads the whole recording, with a progress bar.
fn survey<R: Read>(args: &ExportArgs, log: LogReader<R>, path: &str) -> anyhow::Result<Survey> {
    let size_bytes = std::fs::metadata(&args.file).map_or(0, |file| file.len());
    let bar = progress_bytes(size_bytes);
    let survey = Survey::read(log, path, |bytes| bar.set_position(bytes));
    bar.finish_and_clear();
    survey
}

/// Writes the files and prints the result.
#[allow(
    clippy::too_many_arguments,
    reason = "two readers of the same file, of states and of bytes"
)]
fn export<R: Read>(
    args: &ExportArgs,
    survey: &Survey,
    steps: &[u64],
    format: &Format<'_>,
    open: impl Fn() -> Result<LogReader<R>, ReadError>,
    open_bytes: &OpenBytes<'_>,
) -> anyhow::Result<()> {
    let visit = |visitor: &mut dyn FnMut(&SceneState) -> anyhow::Result<ControlFlow<()>>| {
        let bar = progress_bar(steps.len() as u64);
        let mut states = SceneStates::new(open()?);
        for step in steps {
            // Only errors of reading get the name of the recording.
            let state = states.next_from(*step).with_context(|| output::path_text(&args.file))?;
            bar.inc(1);
            let Some(state) = state.filter(|state| state.row.step == *step) else { break };
            if visitor(state)?.is_break() {
                break;
            }
        }
        bar.finish_and_clear();
        Ok(())
    };
    let snapshots = survey.snapshots(steps, &visit, open_bytes);
    let frames_per_s = args.fps.filter(|_| format.data().is_some_and(DataFormat::has_frames));
    let snapshots = Snapshots { frames_per_s, ..snapshots };
    let existing = args.overwrite.existing();
    let written = match *format {
        Format::Pictures(format, folder) => {
            let target = Target::new(folder, format, existing, &survey.run.scene_name);
            let written = pictures::draw(&snapshots, args.picture_options(), &target)?;
            let files: Vec<_> = written.iter().map(|picture| picture.file.as_str()).collect();
            return output::result(args.as_json, &written, &files.join("\n"));
        }
        Format::Animation(path) => {
            pictures::animate(&snapshots, args.picture_options(), args.pace(), path, existing)?
        }
        Format::Data(format, target) => data::write(&snapshots, format, target, existing)?,
    };
    if format.is_stdout() {
        output::note(&written.to_string());
        return Ok(());
    }
    output::result(args.as_json, &written, &written.to_string())
}

impl ExportArgs {
    fn selection(&self, format: &Format<'_>) -> Selection {
        let choice = match (self.every, self.frames) {
            (Some(period), _) => Choice::Every(period),
            (_, Some(count)) => Choice::Spread(count),
            _ if !self.at.is_empty() => Choice::At(self.at.clone()),
            _ if matches!(format, Format::Pictures(..)) => Choice::Spread(FRAMES_DEFAULT),
            _ if matches!(format, Format::Animation(_)) => Choice::Every(self.frame_time()),
            _ if self.fps.is_some() => Choice::All,
            _ if format.data() == Some(DataFormat::Foxglove) => Choice::Every(SCENE_PERIOD),
            _ => Choice::All,
        };
        Selection { range: SnapshotRange { from: self.from, to: self.to }, choice }
    }

    fn picture_options(&self) -> PictureOptions {
        let style = match self.style {
            Some(StyleArg::Shaded) => Style::Shaded,
            _ => Style::Wires(if self.no_bend { Bend::Hide } else { Bend::Draw }),
        };
        let view = self.view.map(View::from);
        PictureOptions { size: self.size.unwrap_or(SIZE_DEFAULT), view, style }
    }

    /// Returns the wall-clock time of a frame.
    fn frame_time(&self) -> Duration {
        Duration::from_secs(1) / u32::from(self.fps.unwrap_or(FRAMES_PER_S_DEFAULT))
    }

    /// Returns the pace of an animation.
    fn pace(&self) -> FramePace {
        let frame_time = self.frame_time();
        if self.frames.is_some() || !self.at.is_empty() {
            return FramePace { frame_time, period: None };
        }
        FramePace { frame_time, period: Some(self.every.unwrap_or(frame_time)) }
    }

    /// Refuses options that the format ignores.
    fn check(&self) -> Result<(), clap::Error> {
        let Some(format) = self.format.format() else { return Ok(()) };
        let is_picture = format.data().is_none();
        let has_frames = format.data().is_some_and(DataFormat::has_frames);
        let of_pictures = "pictures (--png, --svg, --apng)";
        let of_frames = "--apng, --obj, --vtk, --pc2 and --usda";
        let takes_fps = has_frames || matches!(format, Format::Animation(_));
        let ignored = [
            ("--fps", self.fps.is_some() && !takes_fps, of_frames),
            ("--size", self.size.is_some() && !is_picture, of_pictures),
            ("--view", self.view.is_some() && !is_picture, of_pictures),
            ("--style", self.style.is_some() && !is_picture, of_pictures),
            ("--no-bend", self.no_bend && !is_picture, of_pictures),
            ("--no-bend", self.no_bend && self.style == Some(StyleArg::Shaded), "--style wires"),
        ];
        let conflict =
            |text: String| Err(clap::Error::raw(ErrorKind::ArgumentConflict, format!("{text}\n")));
        if let Some((option, _, formats)) =
            ignored.into_iter().find(|(_, is_ignored, _)| *is_ignored)
        {
            return conflict(format!("{option} has an effect only on {formats}: remove it"));
        }
        let selects = self.every.is_some() || self.frames.is_some() || !self.at.is_empty();
        if has_frames && self.fps.is_some() && selects {
            let text = "--fps selects the frames of this format: remove --every, --frames and --at";
            return conflict(text.to_owned());
        }
        Ok(())
    }
}

fn moment(text: &str) -> Result<Moment, String> {
    let step = text.parse().map(Moment::Step);
    let time = || parse::duration(text).map(Moment::Time);
    step.or_else(|_| time()).map_err(|_| {
        "it must be a step, such as 480, or a time with its unit, such as 2s".to_owned()
    })
}

fn frames(text: &str) -> Result<usize, String> {
    let count = whole_number_in(text, &(1..=65_535))?;
    usize::try_from(count).map_err(|error| error.to_string())
}

fn frames_per_s(text: &str) -> Result<u16, String> {
    let count = whole_number_in(text, &(1..=100))?;
    u16::try_from(count).map_err(|error| error.to_string())
}

fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (SIDE_MIN..=SIDE_MAX).contains(side));
    let size = text
        .split_once('x')
        .and_then(|(width, height)| Some(Size { width: side(width)?, height: side(height)? }));
    size.ok_or_else(|| format!("it must be WIDTHxHEIGHT with sides from {SIDE_MIN} to {SIDE_MAX}"))
}

fn period(text: &str) -> Result<Duration, String> {
    let is_count = text.parse::<u64>().is_ok();
    let time = parse::duration(text).map_err(|error| {
        if is_count { format!("{error} (--frames N exports N snapshots)") } else { error }
    });
    match time? {
        Duration::ZERO => Err("it must be a time longer than 0s".to_owned()),
        period => Ok(period),
    }
}
