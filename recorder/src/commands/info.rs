//! `recorder info`: the content of a recording.

mod energy;
mod graph;
mod report;
mod timing;

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recording::pictures::encode_svg;
use recording::{IntactParts, LogEnd, LogReader, Message, PartFile, ReadError};
use sim_host::Stop;

use crate::cli::args::OverwriteArgs;
use crate::cli::damaged_input::intact_parts;
use crate::cli::output::{self, AsJson, Exit};
use energy::EnergyReport;
use graph::{COLUMNS_MAX, ColumnCollector, Columns, Graph};
use report::{Info, inspect};
use timing::{Timing, period_ns};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Of a damaged recording, shows what `recorder repair` would save. Lateness and solver times are those of the recorded steps. A step counts as late if it \
    woke up more than a period of the scene's rate after its deadline.\n\n\
    Exit codes: 0 complete; 1 not a recording, no measured times, or OUT.svg exists; 3 messages lost, or file truncated \
    or damaged.\n\nExamples:\n  \
    recorder info run.mcap\n  \
    recorder info run.mcap --json\n  \
    recorder info run.mcap --energy\n  \
    recorder info run.mcap --timing --svg timing.svg"
)]
pub(crate) struct InfoArgs {
    /// Recording to read. Every checksum is verified
    file: PathBuf,
    /// Print only the late steps and the measured times. Fails if no time was measured
    #[arg(long)]
    timing: bool,
    /// Print the energy of the first and of the last snapshot, and the limits of its sum: recorded, or measured if it was
    /// not recorded
    #[arg(long, conflicts_with = "timing")]
    energy: bool,
    /// Draw wake-up lateness and solver time over the steps into this SVG file
    #[arg(long, value_name = "OUT.svg", requires = "timing")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    #[command(flatten)]
    as_json: AsJson,
}

pub(crate) fn run(args: &InfoArgs) -> anyhow::Result<Exit> {
    if let Some(svg) = &args.svg {
        check_output(args, svg)?;
    }
    let path = output::path_text(&args.file);
    let stop = Stop::install()?;
    let open = || LogReader::open_until(&args.file, &stop);
    let mut log = open().with_context(|| path.clone())?;
    let size_bytes = fs::metadata(&args.file).with_context(|| path.clone())?.len();
    let inspected = inspect(&mut log, path.clone(), size_bytes);
    let (mut info, end) = inspected.with_context(|| path.clone())?;
    let saves_more = |parts: &IntactParts| parts.snapshot_count() > info.snapshot_count;
    let parts = intact_parts(&args.file, &end, &stop, saves_more)?;
    let done = match &parts {
        None => {
            print(args, &info, open).with_context(|| path.clone())?;
            "read as far as it goes"
        }
        Some(parts) => {
            info = inspect(&mut parts.reader()?, path.clone(), size_bytes)?.0;
            info.file_end = end.to_string();
            print(args, &info, || parts.reader()).with_context(|| path.clone())?;
            "read what is intact"
        }
    };
    if end != LogEnd::Complete {
        output::warn_incomplete(&args.file, &end, done);
    }
    Ok(if end == LogEnd::Complete && info.lost.is_empty() { Exit::Done } else { Exit::Loss })
}

/// Fails if the graph may not be written.
fn check_output(args: &InfoArgs, svg: &Path) -> anyhow::Result<()> {
    let is_input = |path: &Path| path.canonicalize().ok() == args.file.canonicalize().ok();
    if svg.exists() && is_input(svg) {
        bail!("{}: is the recording itself; name another file for --svg", svg.display());
    }
    Ok(args.overwrite.existing().check(svg)?)
}

/// Prints the report, the energy, or the measured times, and draws these if asked to.
fn print<R: Read>(
    args: &InfoArgs,
    info: &Info,
    open: impl FnOnce() -> Result<LogReader<R>, ReadError>,
) -> anyhow::Result<()> {
    if args.energy {
        let energy = EnergyReport::read(open()?)?;
        return output::result(args.as_json, &energy, &energy.to_string());
    }
    if !args.timing {
        return output::result(args.as_json, info, &info.to_string());
    }
    let Some(timing) = &info.timing else {
        bail!(
            "has no measured times ({}); `recorder record` records those of a running node",
            info.untimed_reason()
        );
    };
    if let Some(svg) = &args.svg {
        let graph = graph(open()?, info, timing)?;
        PartFile::write_whole(svg, args.overwrite.existing(), graph.as_bytes())?;
    }
    output::result(args.as_json, timing, &timing.to_string())
}

/// Reads the recording again, and returns the graph of its times as SVG.
fn graph<R: Read>(log: LogReader<R>, info: &Info, timing: &Timing) -> anyhow::Result<String> {
    let [wake_late, solve] = columns(log, timing)?;
    let graph = Graph {
        title: format!("{}: {}, {} Hz", info.file_name(), info.scene, info.rate_hz),
        steps: timing.steps,
        period_ns: period_ns(info.rate_hz),
        wake_late: &wake_late,
        solve: &solve,
    };
    Ok(encode_svg(&graph.draw()))
}

/// Returns the columns of the wake-up lateness and of the solver time.
fn columns<R: Read>(mut log: LogReader<R>, timing: &Timing) -> anyhow::Result<[Columns; 2]> {
    let measured_count = usize::try_from(timing.measured_steps).unwrap_or(usize::MAX);
    let mut collector = ColumnCollector::new(timing.steps, measured_count.min(COLUMNS_MAX))?;
    while let Some(logged) = log.next_message()? {
        if let Message::Step(row) = &logged.message {
            collector.add(row);
        }
    }
    Ok(collector.finish())
}

#[cfg(test)]
mod tests {
    use recording::{Closing, LogOptions, LogWriter, RunDescription, StepRow, TearsRow};

    use super::*;

    /// Returns a recorded run with this wall clock of step 0.
    fn run(epoch_ns: u64) -> RunDescription {
        RunDescription {
            run_id: 7,
            epoch_ns,
            scene_name: "points".to_owned(),
            rate_hz: 100,
            constraint_count: 9,
            solver_version: 1,
            contract_version: 1,
            recorder_version: "0".to_owned(),
            ..RunDescription::default()
        }
    }

    /// Returns a file with these messages and their times of reception.
    fn file(epoch_ns: u64, messages: &[(Message, u64)], closing: Option<&Closing>) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut log =
            LogWriter::create(&mut bytes, LogOptions::default(), &run(epoch_ns), b"version = 1", 0)
                .unwrap();
        for (message, log_time_ns) in messages {
            log.write(message, *log_time_ns).unwrap();
        }
        log.flush().unwrap();
        if let Some(closing) = closing {
            log.finish(closing).unwrap();
        } else {
            drop(log);
        }
        bytes
    }

    fn inspected(bytes: &[u8]) -> Info {
        let mut log = LogReader::new(bytes).unwrap();
        inspect(&mut log, "run.mcap".to_owned(), 1000).unwrap().0
    }

    fn snapshot(row: StepRow) -> [Message; 2] {
        [Message::Step(row), Message::Particles { step: row.step, particles: Vec::new() }]
    }

    /// Returns the report on a file with the headers of two snapshots.
    fn report(indices: [u32; 2], closing: Option<&Closing>) -> (Info, String) {
        let rows = (0..).zip(indices);
        let rows =
            rows.map(|(step, index)| StepRow { step, snapshot_index: index, ..StepRow::default() });
        let messages: Vec<_> = rows.map(|row| (Message::Step(row), 0)).collect();
        let info = inspected(&file(0, &messages, closing));
        let text = info.to_string();
        let lost = text.lines().find(|line| line.starts_with("lost")).unwrap().to_owned();
        (info, lost)
    }

    #[test]
    fn every_message_of_the_file_is_counted() {
        let (info, _) = report([0, 1], None);
        assert_eq!((info.messages["/tf"], info.messages["/steps"]), (1, 2));
        assert_eq!(info.messages.values().sum::<u64>(), 3);
    }

    #[test]
    fn the_losses_of_a_file_without_an_end_follow_from_the_numbers_of_its_snapshots() {
        let (_, lost) = report([4, 5], None);
        assert_eq!(lost, "lost        none, as far as the file goes");
        let (_, lost) = report([4, 6], None);
        assert_eq!(lost, "lost        /particles 1, /steps 1, as far as the file goes");
        let (_, lost) = report([4, 5], Some(&Closing::default()));
        assert_eq!(lost, "lost        none");
    }

    /// Ten steps of 10 ms that begin at step 40, each received 12 ms after the one before it, with a
    /// tear in step 45. A step is as many µs late as its number.
    fn ten_steps(epoch_ns: u64, measured: u64) -> Vec<(Message, u64)> {
        let mut messages = Vec::new();
        for step in 40..=49 {
            let log_time_ns = epoch_ns + (step - 40) * 12_000_000;
            if step == 45 {
                let tears = TearsRow { step, constraints: vec![3, 8], causes: Vec::new() };
                messages.push((Message::Tears(tears), log_time_ns));
            }
            let row = StepRow {
                step,
                state_hash: step << 60 | step,
                torn_count: if step < 45 { 1 } else { 3 },
                wake_late_ns: measured * step * 1000,
                solve_ns: measured * 30_000_000,
                snapshot_index: u32::try_from(step).unwrap(),
                ..StepRow::default()
            };
            messages.extend(snapshot(row).map(|message| (message, log_time_ns)));
        }
        messages
    }

    #[test]
    fn the_page_of_a_live_recording_has_rates_times_and_tears() {
        let closing = Closing { stop_reason: "signal".to_owned(), ..Closing::default() };
        let info = inspected(&file(1 << 60, &ten_steps(1 << 60, 1), Some(&closing)));
        insta::assert_snapshot!(info.to_string());
        let json = serde_json::to_value(&info).unwrap();
        assert_eq!((&json["duration_s"], &json["wall_clock_s"]), (&0.09.into(), &0.108.into()));
        assert_eq!(json["last_state_hash"], "1000000000000031");
        assert_eq!(json["timing"]["wake_late"]["max_us"], 49.0);
    }

    #[test]
    fn the_page_of_a_simulated_recording_says_that_no_time_was_measured() {
        let info = inspected(&file(0, &ten_steps(0, 0), Some(&Closing::default())));
        assert_eq!((info.wall_clock_s, &info.timing), (None, &None));
        insta::assert_snapshot!(info.to_string());
    }

    #[test]
    fn the_hash_of_a_truncated_file_is_that_of_its_last_complete_snapshot() {
        let mut messages = ten_steps(0, 0);
        messages.truncate(messages.len() - 1);
        let info = inspected(&file(0, &messages, None));
        assert_eq!(info.last_step, Some(48));
        assert_eq!(info.last_state_hash.as_deref(), Some("0000000000000030"));
    }

    #[test]
    fn a_snapshot_without_its_header_has_no_hash() {
        let mut messages = ten_steps(0, 0);
        messages.push((Message::Particles { step: 50, particles: Vec::new() }, 0));
        let info = inspected(&file(0, &messages, None));
        assert_eq!(info.last_step, Some(50));
        assert_eq!((info.last_state_hash, info.torn_count_last), (None, None));
        assert_eq!(info.torn_count_first, Some(1));
    }
}
