//! `recorder play`: plays a recording on the services of a node.

mod control;
mod keyboard;
mod lockstep;
mod player;
mod playlist;
mod recording;
mod replay;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::bail;
use sim_host::clock::SECOND_NS;
use sim_host::{Stop, report_bus_errors};

use crate::cli::args::EndpointArgs;
use crate::cli::output::{self, Exit};
use crate::cli::parse::{self, whole_number};
use control::{Control, MAX_RATE, Pace, RATES};
use keyboard::Keyboard;
use lockstep::Lockstep;
use player::{Plan, Player, Speed};
use playlist::Playlist;

#[derive(Debug, clap::Args)]
#[command(after_help = after_help())]
pub(crate) struct PlayArgs {
    /// Recordings to play, one after another. Files of one run without a gap between them, such as those of
    /// `recorder record --split-size`, play as one; each other file begins a new run
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    endpoint: EndpointArgs,
    /// Simulated time per wall-clock time, 0.01 to 100, or max: as fast as the members of the lockstep take
    /// the snapshots. Pauses of the recorded run are skipped
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
    /// Pause after the first snapshot, until a key or a command resumes it
    #[arg(long)]
    paused: bool,
    /// Wait for this many readers before the first snapshot
    #[arg(long, value_name = "N", default_value_t = 0, allow_hyphen_values = true, value_parser = whole_number)]
    wait_for_readers: u64,
}

fn after_help() -> String {
    format!(
        "Obeys these commands of clients; `sim-node ctl` sends them: pause, resume, step N, rewind TIME or \
         --to-step N (a step before or after the present one), and set time_scale 0.01 to 100. A paused replay \
         stays at its last snapshot. A reader in the lockstep (`recorder record --lockstep`) misses no snapshot \
         at any rate: the replay waits for it. It does not wait for other readers. Each pass of --loop, and each jump to another place, begins a new \
         run.\n\n{}\n\nExit codes: 0 played; 1 failed; 3 a file is truncated or damaged and was played as \
         far as it goes, if at all.\n\nExamples:\n  \
         recorder play run.mcap\n  \
         recorder play run.mcap --rate 0.25 --loop\n  \
         recorder play run_*.mcap --paused\n  \
         recorder play run.mcap --start 2s --end 3500ms --wait-for-readers 1",
        keyboard::HELP
    )
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        _ if text == "max" => Ok(MAX_RATE),
        Ok(rate) if RATES.contains(&rate) => Ok(rate),
        _ => Err("it must be a number from 0.01 to 100, or max".to_owned()),
    }
}

pub(crate) fn run(args: &PlayArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    report_bus_errors()?;
    match play(args, &stop) {
        Err(_) if stop.is_requested() => Ok(Exit::Done),
        played => played,
    }
}

fn play(args: &PlayArgs, stop: &Stop) -> anyhow::Result<Exit> {
    let endpoint = args.endpoint.endpoint()?;
    if args.end.is_some_and(|end| end < args.start.unwrap_or_default()) {
        let problem = "--end is before --start: nothing would be played\n";
        output::with_usage(&clap::Error::raw(clap::error::ErrorKind::ValueValidation, problem));
    }
    let playlist = Playlist::open(&args.files, stop)?;
    let mut player = Player {
        plan: plan(args, &playlist)?,
        endpoint,
        playlist,
        control: Control::new(args.paused, args.rate),
        pace: Pace::new(args.rate),
        lockstep: Lockstep::default(),
        speed: Speed::default(),
        keyboard: Keyboard::open(stop)?,
        commands: VecDeque::new(),
        next_status_ns: 0,
        is_quit: false,
        is_at_end: false,
    };
    let ready = format!("ready playing {} as {}", names(&args.files), player.endpoint);
    let played = player.play(stop, || output::note(&ready));
    output::end_live();
    played?;
    // Not before the end, because it reads the files again, which delays no snapshot then.
    Ok(if player.playlist.note_losses() { Exit::Done } else { Exit::Loss })
}

/// Returns the part to play, or an error if there is nothing in it.
fn plan(args: &PlayArgs, playlist: &Playlist) -> anyhow::Result<Plan> {
    let duration_ns = playlist.duration_ns();
    let start = args.start.unwrap_or_default();
    let start_ns = nanoseconds(start);
    if start_ns > duration_ns {
        let (start, last_s) =
            (humantime::format_duration(start), duration_ns as f64 / SECOND_NS as f64);
        bail!(
            "{}: --start {start} is after its last snapshot, which is at {last_s:.3} s",
            names(&args.files)
        );
    }
    let start_ns = playlist.time_of(playlist.place_at(start_ns));
    let end_ns = args.end.map_or(duration_ns, nanoseconds).min(duration_ns);
    Ok(Plan { start_ns, end_ns, loops: args.loops, readers: args.wait_for_readers })
}

/// Returns the name of the only file, or of the first and their number.
fn names(files: &[PathBuf]) -> String {
    let first = files.first().map(|file| output::path_text(file)).unwrap_or_default();
    match files.len() {
        0 | 1 => first,
        count => format!("{first} and {} more", count - 1),
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
