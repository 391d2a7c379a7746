//! `recorder play`: plays a recording on the services of a node.

mod control;
mod pace;
mod position;
mod replay;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use recorder::{
    CollidersRow, ContentSelection, FileSource, Frame, FrameReader, LogEnd, LogReader, Message,
    SurfaceRow, TopologyRow, torn_before_first,
};
use sim_contract::clock::{SECOND_NS, monotonic_ns, sleep_until};
use sim_contract::{Endpoint, Method, Stop, report_bus_errors};
use sim_solver::Solver;

use crate::cli::endpoint_args::EndpointArgs;
use crate::cli::exit::{self, Exit};
use crate::cli::output;
use crate::cli::parse::{self, whole_number};
use crate::input::scene_source::scene_in_recording;
use control::Control;
use pace::Pace;
use position::Position;
use replay::{Recorded, Replay};

/// Longest wait before the next check for commands, readers and signals.
const WAIT_MAX_NS: u64 = SECOND_NS / 100;
/// Period of the status messages: 10 Hz.
const STATUS_PERIOD_NS: u64 = SECOND_NS / 10;
/// Time for which the services stay after the last snapshot, so that its readers can finish.
const LINGER_NS: u64 = SECOND_NS / 10;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Obeys pause, resume and step like a node, for example `sim-node ctl pause`.\n\n\
    Exit codes: 0 played; 1 failed; 3 the file is truncated or damaged and was played as far as it \
    goes.\n\nExamples:\n  \
    recorder play run.mcap\n  \
    recorder play run.mcap --rate 0.25 --loop\n  \
    recorder play run.mcap --start 2s --end 3500ms --wait-for-readers 1"
)]
pub(crate) struct PlayArgs {
    /// Recording to play
    file: PathBuf,
    #[command(flatten)]
    endpoint: EndpointArgs,
    /// Simulated time per wall-clock time, above 0 and up to 1000. Pauses of the recorded run are
    /// skipped
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_hyphen_values = true, value_parser = rate)]
    rate: f64,
    /// Start again at the end, as a new run
    #[arg(long = "loop")]
    loops: bool,
    /// Start at this simulated time after the first snapshot, such as 2s or 500ms [default: 0s]
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse::duration)]
    start: Option<Duration>,
    /// End at this simulated time after the first snapshot [default: the end of the recording]
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse::duration)]
    end: Option<Duration>,
    /// Pause after the first snapshot until `ctl resume` or `ctl step`
    #[arg(long)]
    paused: bool,
    /// Wait for this many readers before the first snapshot
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true, value_parser = whole_number)]
    wait_for_readers: u64,
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate > 0.0 && rate <= 1000.0 => Ok(rate),
        _ => Err("it must be a number above 0 and up to 1000".to_owned()),
    }
}

pub(crate) fn run(args: &PlayArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    report_bus_errors()?;
    let endpoint = args.endpoint.endpoint()?;
    let path = output::path_text(&args.file);
    if args.end.is_some_and(|end| end < args.start.unwrap_or_default()) {
        let problem = "--end is before --start: nothing would be played\n";
        exit::with_usage(&clap::Error::raw(clap::error::ErrorKind::ValueValidation, problem));
    }
    let mut is_first = true;
    let mut is_paused = args.paused;
    loop {
        let mut pass = match Pass::open(args, &endpoint, &stop) {
            Err(_) if stop.is_requested() => return Ok(Exit::Done),
            pass => pass.with_context(|| path.clone())?,
        };
        // A pause at the end of a pass also applies to the next one.
        pass.replay.control = Control::new(is_paused);
        let readers = if is_first { args.wait_for_readers } else { 0 };
        if is_first {
            output::note(&format!("ready playing {path} as {endpoint}"));
        }
        let end = match pass.play(readers, &stop) {
            Err(_) if stop.is_requested() => return Ok(Exit::Done),
            end => end.with_context(|| path.clone())?,
        };
        is_paused = pass.replay.control.is_paused;
        is_first = false;
        if let Some(end) = &end
            && *end != LogEnd::Complete
        {
            output::warn_incomplete(&args.file, end, "played as far as it goes");
        }
        if !args.loops || stop.is_requested() {
            let is_whole = end.is_none_or(|end| end == LogEnd::Complete);
            return Ok(if is_whole { Exit::Done } else { Exit::Loss });
        }
    }
}

/// One pass over the file.
#[derive(Debug)]
struct Pass {
    frames: FrameReader<FileSource>,
    first: Frame,
    /// Recorded time of the last snapshot to play, in nanoseconds since 1970.
    end_ns: u64,
    replay: Replay,
    pace: Pace,
    next_status_ns: u64,
}

impl Pass {
    /// Skips to the first snapshot to play, and becomes the owner of the name.
    fn open(args: &PlayArgs, endpoint: &Endpoint, stop: &Stop) -> anyhow::Result<Self> {
        let log = LogReader::open_until(&args.file, stop)?;
        log.selection().require(&ContentSelection::FOR_STATES, "`recorder play`")?;
        log.selection().require_all_particles("`recorder play`")?;
        let (run, scene) = (log.run().clone(), log.scene().to_vec());
        let solver = Solver::new(&scene_in_recording(&log)?);
        let mut frames = FrameReader::new(log);
        let mut first = next_frame(&mut frames)?;
        let (topology, surface) = load_rows(&first)?;
        let colliders = first_colliders(&first).map(|row| row.colliders.len());
        let collider_count = colliders.unwrap_or_else(|| solver.collider_count());
        let origin_ns = run.time_of_step_ns(first.row.step);
        let start_ns = origin_ns.saturating_add(nanoseconds(args.start.unwrap_or_default()));
        let torn = torn_before_first(&topology, &first);
        let method = Method::from_number(run.method).unwrap_or_default();
        let mut position = Position::new(torn, method);
        while run.time_of_step_ns(first.row.step) < start_ns {
            position.skip(&first.updates);
            let time_ns = run.time_of_step_ns(first.row.step).saturating_sub(origin_ns);
            first = frames.next_frame()?.with_context(|| late_start(args, time_ns))?;
        }
        first.updates.iter().for_each(|update| position.apply_parameters(update));
        let recorded = Recorded {
            run: &run,
            scene: &scene,
            topology: &topology,
            surface: &surface,
            collider_count,
            keyframe_size_bytes_max: solver.keyframe_size_bytes_max(),
        };
        let replay = Replay::new(endpoint, &recorded, position, args.rate)?;
        let end_ns = args.end.map_or(u64::MAX, |end| origin_ns.saturating_add(nanoseconds(end)));
        let pace = Pace::new(args.rate);
        Ok(Self { frames, first, end_ns, replay, pace, next_status_ns: 0 })
    }

    /// Plays to the end or until a signal. Returns the end of the file, if it was reached.
    fn play(&mut self, readers: u64, stop: &Stop) -> anyhow::Result<Option<LogEnd>> {
        let first_step = self.first.row.step;
        self.wait_for_readers(readers, first_step, stop)?;
        self.replay.publish_latched(first_step)?;
        let mut next = Some(self.first.clone());
        let mut last_step = first_step;
        while let Some(frame) = next {
            let time_ns = self.frames.log().run().time_of_step_ns(frame.row.step);
            if time_ns > self.end_ns || !self.wait_until_due(time_ns, frame.row.step, stop)? {
                break;
            }
            self.replay.publish(&frame)?;
            last_step = frame.row.step;
            // Read ahead, so that decompression happens during the wait.
            next = self.frames.next_frame()?;
        }
        self.linger(last_step + 1, stop)?;
        Ok(self.frames.end().cloned())
    }

    fn wait_for_readers(&mut self, count: u64, step: u64, stop: &Stop) -> anyhow::Result<()> {
        while (self.replay.reader_count() as u64) < count && !stop.is_requested() {
            self.attend(step)?;
            sleep_until(monotonic_ns() + WAIT_MAX_NS);
        }
        Ok(())
    }

    /// Waits until a snapshot is due. Returns `false` on a signal.
    fn wait_until_due(&mut self, time_ns: u64, step: u64, stop: &Stop) -> anyhow::Result<bool> {
        loop {
            self.attend(step)?;
            if stop.is_requested() {
                return Ok(false);
            }
            let now_ns = monotonic_ns();
            if self.replay.control.is_moving() {
                let deadline_ns = self.pace.deadline_ns(time_ns, now_ns);
                if now_ns >= deadline_ns {
                    return Ok(true);
                }
                sleep_until(deadline_ns.min(now_ns + WAIT_MAX_NS));
            } else {
                self.pace.restart();
                sleep_until(now_ns + WAIT_MAX_NS);
            }
        }
    }

    /// Answers commands, serves late subscribers, and publishes the status.
    fn attend(&mut self, next_step: u64) -> anyhow::Result<()> {
        // Publishes a fresh status after commands, so that `ctl status` shows their effect.
        let has_commands = self.replay.answer_commands(next_step)?;
        let now_ns = monotonic_ns();
        if has_commands || now_ns >= self.next_status_ns {
            self.next_status_ns = now_ns + STATUS_PERIOD_NS;
            self.replay.publish_status()?;
        }
        Ok(())
    }

    fn linger(&mut self, next_step: u64, stop: &Stop) -> anyhow::Result<()> {
        let end_ns = monotonic_ns() + LINGER_NS;
        while monotonic_ns() < end_ns && !stop.is_requested() {
            self.attend(next_step)?;
            sleep_until(monotonic_ns() + WAIT_MAX_NS);
        }
        Ok(())
    }
}

/// Returns the error for a start after the last snapshot.
fn late_start(args: &PlayArgs, last_ns: u64) -> String {
    let start = humantime::format_duration(args.start.unwrap_or_default());
    let last_s = last_ns as f64 / SECOND_NS as f64;
    format!("--start {start} is after its last snapshot, which is at {last_s:.3} s")
}

fn next_frame(frames: &mut FrameReader<FileSource>) -> anyhow::Result<Frame> {
    match frames.next_frame()? {
        Some(frame) => Ok(frame),
        None => match frames.end() {
            Some(LogEnd::Complete) | None => bail!("has no snapshot to play"),
            Some(end) => bail!("has no snapshot to play: {end}"),
        },
    }
}

/// Returns the topology and the surface, which precede the first snapshot.
fn load_rows(first: &Frame) -> anyhow::Result<(TopologyRow, SurfaceRow)> {
    let topology = first.updates.iter().find_map(|update| match update {
        Message::Topology(row) => Some(row.clone()),
        _ => None,
    });
    let surface = first.updates.iter().find_map(|update| match update {
        Message::Surface(row) => Some(row.clone()),
        _ => None,
    });
    let topology = topology.context("has no /topology before its first snapshot")?;
    Ok((topology, surface.context("has no /surface before its first snapshot")?))
}

/// Returns the first colliders. Their number never changes in a recording.
fn first_colliders(first: &Frame) -> Option<&CollidersRow> {
    first.updates.iter().find_map(|update| match update {
        Message::Colliders(row) => Some(row),
        _ => None,
    })
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
