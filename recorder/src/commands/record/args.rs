//! The options of `recorder record`.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use clap::error::ErrorKind;

use super::split::SplitArgs;
use super::splitter::selector::SelectionArgs;
use super::writer::extras::ExtraArgs;
use super::writer::names::FileNames;
use crate::cli::args::{EndpointArgs, FileArgs, default_path};
use crate::cli::output::AsJson;
use crate::cli::parse::{self, whole_number};

/// Default memory for snapshots that wait.
const QUEUE_BYTES_DEFAULT: u64 = 256 << 20;

/// Flush interval of a recording of one step.
const FLUSH_INTERVAL_DEFAULT: Duration = Duration::from_secs(1);
/// Times that a black box can keep.
const BLACK_BOX_SPANS: RangeInclusive<Duration> = Duration::from_secs(1)..=Duration::from_hours(1);

/// Flush intervals. Each flush closes a chunk, and waits for the disk.
const FLUSH_INTERVALS: RangeInclusive<Duration> =
    Duration::from_millis(100)..=Duration::from_hours(1);

/// Options of a recording.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Ends cleanly on Ctrl-C, on SIGTERM or SIGHUP, and at a limit. Without --follow, it also ends with the \
    node, when another scene is loaded, and when another run starts (as with play --loop).\n\n\
    With --follow, --black-box or a limit of a file, -o run.mcap names the files run_0000.mcap, run_0001.mcap and so \
    on. Each begins with the scene, the latest constraints, triangles, parameters, colliders and torn \
    constraints, and a keyframe, so it plays and verifies alone. No step is in two files.\n\n\
    Exit codes: 0 all recorded; 1 failed; 3 messages lost.\n\nExamples:\n  \
    recorder record -o run.mcap\n  \
    recorder record --name left --duration 10s --compression none\n  \
    recorder record -o run.mcap --steps 2400 --json\n  \
    recorder record -o run.mcap --progress --json\n  \
    recorder record -o run.mcap --follow --wait\n  \
    recorder record -o run.mcap --split-size 1GB --max-files 10 --min-free 5GB\n  \
    recorder record -o run.mcap --min-free 5GB\n  \
    recorder record -o incident.mcap --black-box 30s --max-files 10\n  \
    recorder record -o run.mcap --every 10 --meta operator=Ada\n  \
    recorder record -o flight.mcap --only-commands && recorder simulate flight.mcap -o run.mcap"
)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    pub(super) endpoint: EndpointArgs,
    /// File to write. Its name ends in `.part` until it is finished
    /// [default: NAME_<UTC time>.mcap; NAME.mcap for a ring of files]
    #[arg(short, long, value_name = "OUT.mcap")]
    pub(super) output: Option<PathBuf>,
    /// Go on in the next file when another scene is loaded, when another run starts, and after a
    /// restart of the node
    #[arg(long, conflicts_with = "steps")]
    pub(super) follow: bool,
    /// Wait until a node is running
    #[arg(long)]
    pub(super) wait: bool,
    /// Join the lockstep: the node or replay waits at each published step until this recorder has read
    /// it. A node drops a member after its --lockstep-timeout, a replay after 10 s
    #[arg(long)]
    pub(super) lockstep: bool,
    #[command(flatten)]
    pub(super) split: SplitArgs,
    /// Keep the last TIME in memory, such as 30s, from 1s to 1h. Write it, and a second more, on
    /// `sim-node ctl mark`, on a tear, on a frozen particle and on SIGUSR1, each time into another file
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = black_box_span,
        conflicts_with_all = ["steps", "split_size", "split_duration"])]
    pub(super) black_box: Option<Duration>,
    #[command(flatten)]
    pub(super) selection: SelectionArgs,
    /// End this time after the first recorded step, such as 10s or 500ms. A node at real time has then
    /// made the steps of that time; one that is paused or slowed has made fewer. It is also the longest wait
    /// for a node, and for a first step [default: no limit]
    #[arg(long, value_name = "TIME", allow_hyphen_values = true,
        value_parser = parse::duration)]
    pub(super) duration: Option<Duration>,
    /// End N steps after the first recorded step [default: no limit]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = whole_number)]
    pub(super) steps: Option<u64>,
    /// Memory for snapshots that wait to be written, such as 512MiB, from 1MiB to 1TiB. Snapshots that do
    /// not fit are lost and counted. With --black-box, also the memory for what is
    /// kept, besides the last second or two
    #[arg(long, value_name = "SIZE", default_value = "256MiB",
        allow_hyphen_values = true, value_parser = queue_bytes)]
    pub(super) queue_bytes: u64,
    /// Longest time that messages wait in memory, from 100ms to 1h: what a killed recorder loses
    #[arg(long, value_name = "TIME", default_value = "1s", allow_hyphen_values = true,
        value_parser = flush_interval)]
    pub(super) flush_interval: Duration,
    /// Do not wait at each flush until the recording is on the disk. A power cut may then lose much
    /// more than the last interval
    #[arg(long)]
    pub(super) no_sync: bool,
    #[command(flatten)]
    pub(super) extras: ExtraArgs,
    #[command(flatten)]
    pub(super) file: FileArgs,
    /// Print a line of JSON four times a second, for a program that shows the progress: the seconds since the start,
    /// and of the newest file its number from 0, snapshots, size and losses. The recording then also ends, cleanly, when the
    /// reader of the lines has gone
    #[arg(long, conflicts_with = "black_box")]
    pub(super) progress: bool,
    #[command(flatten)]
    pub(super) as_json: AsJson,
}

/// Options of `recorder state`, a recording of one step.
#[derive(Debug, Clone, clap::Args)]
#[command(
    after_help = "A state is a recording of one step. `recorder restore` puts it in place again.\n\nExamples:\n  \
    recorder state -o state.mcap\n  \
    recorder restore state.mcap"
)]
pub(crate) struct StateArgs {
    #[command(flatten)]
    endpoint: EndpointArgs,
    /// File to write [default: NAME_<UTC time>.mcap]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Longest wait for a state, such as 10s or 500ms
    #[arg(long, value_name = "TIME", default_value = "5s", allow_hyphen_values = true,
        value_parser = parse::duration)]
    timeout: Duration,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    as_json: AsJson,
}

impl From<StateArgs> for RecordArgs {
    fn from(args: StateArgs) -> Self {
        let StateArgs { endpoint, output, timeout, file, as_json } = args;
        Self {
            endpoint,
            output,
            follow: false,
            lockstep: false,
            wait: false,
            split: SplitArgs::default(),
            black_box: None,
            selection: SelectionArgs::default(),
            duration: Some(timeout),
            steps: Some(0),
            queue_bytes: QUEUE_BYTES_DEFAULT,
            flush_interval: FLUSH_INTERVAL_DEFAULT,
            no_sync: false,
            extras: ExtraArgs::default(),
            file,
            progress: false,
            as_json,
        }
    }
}

fn flush_interval(text: &str) -> Result<Duration, String> {
    let interval = parse::duration(text)?;
    let is_valid = FLUSH_INTERVALS.contains(&interval);
    is_valid.then_some(interval).ok_or_else(|| "it must be a time from 100ms to 1h".to_owned())
}

fn black_box_span(text: &str) -> Result<Duration, String> {
    let span = parse::duration(text)?;
    let is_valid = BLACK_BOX_SPANS.contains(&span);
    is_valid.then_some(span).ok_or_else(|| "it must be a time from 1s to 1h".to_owned())
}

fn queue_bytes(text: &str) -> Result<u64, String> {
    let size = parse::size_bytes(text)?;
    let is_valid = (1 << 20..=1 << 40).contains(&size);
    is_valid.then_some(size).ok_or_else(|| "it must be a size from 1MiB to 1TiB".to_owned())
}

impl RecordArgs {
    /// Returns the names of the files. A ring has the same ones after each restart.
    pub(super) fn names(&self, name: &str, now_ns: u64) -> FileNames {
        let default = || {
            if self.is_ring() {
                PathBuf::from(format!("{name}.mcap"))
            } else {
                default_path(name, now_ns)
            }
        };
        let path = self.output.clone().unwrap_or_else(default);
        if self.is_numbered() { FileNames::numbered(path) } else { FileNames::Single(path) }
    }

    fn is_numbered(&self) -> bool {
        self.follows() || self.split.is_given()
    }

    /// Returns `true` if the recording removes its oldest files.
    pub(super) fn is_ring(&self) -> bool {
        self.is_numbered() && self.split.ring().is_given()
    }

    /// Returns `true` if the recording goes on with another load or run. A black box always does.
    pub(super) fn follows(&self) -> bool {
        self.follow || self.black_box.is_some()
    }

    /// Checks options that are useful only with others.
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        if self.split.ring().files_max.is_none() || self.is_numbered() {
            return Ok(());
        }
        let text = "--max-files needs a limit of a file, or --follow: add --split-size or --split-duration\n";
        Err(clap::Error::raw(ErrorKind::MissingRequiredArgument, text))
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Options {
        #[command(flatten)]
        record: RecordArgs,
    }

    fn parse(args: &[&str]) -> RecordArgs {
        Options::parse_from([&["record"], args].concat()).record
    }

    #[test]
    fn a_ring_has_the_same_name_after_each_restart() {
        let name = |args: &[&str]| parse(args).names("sim", 1_764_072_000_000_000_000).path(0);
        let ring = ["--follow", "--min-free", "1GB"];
        assert_eq!(name(&ring), PathBuf::from("sim_0000.mcap"));
        assert_eq!(name(&["--follow"]), PathBuf::from("sim_2025-11-25T12-00-00Z_0000.mcap"));
        assert_eq!(name(&["--min-free", "1GB"]), PathBuf::from("sim_2025-11-25T12-00-00Z.mcap"));
        assert_eq!(name(&["-o", "run.mcap", "--follow"]), PathBuf::from("run_0000.mcap"));
    }

    #[test]
    fn a_file_does_not_begin_on_a_disk_without_its_reserve() {
        let args = parse(&["-o", "run.mcap", "--min-free", "9000000GB"]);
        let error = super::super::check_reserve(&args, &args.names("sim", 0)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "run.mcap: its disk has less free space than the recording is to leave"
        );
    }

    #[test]
    fn a_number_of_files_needs_a_limit_of_a_file_and_a_reserve_does_not() {
        assert!(parse(&["--max-files", "3"]).check().is_err());
        assert!(parse(&["--max-files", "3", "--follow"]).check().is_ok());
        assert!(parse(&["--min-free", "3GB"]).check().is_ok());
    }

    #[test]
    fn the_queue_is_a_size_within_limits() {
        assert_eq!(queue_bytes("512MiB"), Ok(512 << 20));
        assert_eq!((queue_bytes("1048576"), queue_bytes("1TiB")), (Ok(1 << 20), Ok(1 << 40)));
        for text in ["1048575", "1025GiB"] {
            assert_eq!(queue_bytes(text).unwrap_err(), "it must be a size from 1MiB to 1TiB");
        }
        assert!(queue_bytes("much").unwrap_err().contains("such as 100MB or 2GiB"));
    }
}
