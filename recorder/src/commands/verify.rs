//! `recorder verify`: proves that a recording re-simulates bit for bit, and reports
//! the messages that it lacks.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recording::verification::{
    StepGap, StepRange, Verdict, VerifyError, VerifyOptions, VerifyReport, verify,
};
use recording::{IntactParts, LogEnd, LogReader, ReadError, Wanted, find_state};
use sim_contract::printable_line;
use sim_host::Stop;

use crate::cli::args::PartArgs;
use crate::cli::damaged_input::{DamagedInput, intact_parts, lacks, lacks_state};
use crate::cli::output::{self, AsJson, Exit, progress_bytes};
use crate::cli::parse::whole_number;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Simulates the parts between complete states (a snapshot with its keyframe) side by side, compares every \
    state, and lists the messages that are missing. --verbose also lists the content that no state depends on, which is \
    not compared. Of a damaged recording, compares what `recorder repair` would save. Behind missing outcomes, it goes on from the next complete state.\n\n\
    Exit codes: 0 every recorded step is bit-identical, or there is none to compare; 1 not verifiable; 3 different, outcomes missing, or file truncated \
    or damaged.\n\nExamples:\n  \
    recorder verify run.mcap\n  \
    recorder verify run.mcap --from 4800 --to 9600\n  \
    recorder verify run.mcap --json"
)]
pub(crate) struct VerifyArgs {
    /// Recording to re-simulate, from its first snapshot with a keyframe
    file: PathBuf,
    /// Compare the states from this step on. The simulation starts at the last complete state up to it
    #[arg(long, value_name = "STEP", allow_hyphen_values = true, value_parser = whole_number)]
    from: Option<u64>,
    /// Compare the states up to this step
    #[arg(long, value_name = "STEP", allow_hyphen_values = true, value_parser = whole_number)]
    to: Option<u64>,
    /// Also list the content that is not compared
    #[arg(short, long)]
    verbose: bool,
    #[command(flatten)]
    threads: PartArgs,
    #[command(flatten)]
    as_json: AsJson,
}

pub(crate) fn run(args: &VerifyArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let path = output::path_text(&args.file);
    let mut report = args.verify(|| LogReader::open_until(&args.file, &stop), &stop);
    let mut done = "verified as far as it goes";
    if let Some((end, last_step)) = readable_part(&report) {
        let saves_more = |parts: &IntactParts| parts.last_step() > last_step;
        if let Some(parts) = intact_parts(&args.file, &end, &stop, saves_more)? {
            report = args.verify(|| parts.reader(), &stop);
            report = report.map(|report| VerifyReport { end: Some(end), ..report });
            done = "verified what is intact";
        }
    }
    let report = report.with_context(|| path.clone())?;
    args.check_range(&report).with_context(|| path.clone())?;
    output::result(args.as_json, &report, &args.text(&report))?;
    let end = report.incomplete_end();
    if let Some(end) = end {
        output::warn_incomplete(&args.file, end, done);
    }
    Ok(match report.verdict {
        Verdict::Interrupted => Exit::Failed,
        Verdict::Identical if end.is_none() => Exit::Done,
        _ => Exit::Loss,
    })
}

/// Returns the end of the readable part of a file that is not complete, and the last step that was compared.
fn readable_part(report: &anyhow::Result<VerifyReport>) -> Option<(LogEnd, Option<u64>)> {
    match report {
        Ok(report) => Some((report.incomplete_end()?.clone(), report.last_identical_step)),
        Err(error) => Some((error.downcast_ref::<DamagedInput>()?.end().clone(), None)),
    }
}

/// Adds the cause to the error of a damaged file.
fn explain(error: VerifyError, path: &Path) -> anyhow::Error {
    match &error {
        VerifyError::NoKeyframe { end } => lacks(path, &error.to_string(), end.as_ref()),
        _ => error.into(),
    }
}

impl VerifyArgs {
    fn verify<R: Read>(
        &self,
        open: impl Fn() -> Result<LogReader<R>, ReadError>,
        stop: &Stop,
    ) -> anyhow::Result<VerifyReport> {
        let range = self.range(open()?)?;
        let bar = progress_bytes(std::fs::metadata(&self.file).map_or(0, |file| file.len()));
        let options = VerifyOptions { threads: self.threads.count(), range };
        let report = verify(open()?, options, stop.flag(), |bytes| bar.set_position(bytes));
        bar.finish_and_clear();
        report.map_err(|error| explain(error, &self.file))
    }

    /// Refuses a range that begins after the last step: nothing of it was compared.
    fn check_range(&self, report: &VerifyReport) -> anyhow::Result<()> {
        match (self.from, report.last_identical_step) {
            (Some(from), Some(last)) if from > last && report.verdict == Verdict::Identical => {
                bail!("--from {from} is after its last step, {last}")
            }
            _ => Ok(()),
        }
    }

    /// Returns the steps to compare, with the one to start from.
    fn range<R: Read>(&self, log: LogReader<R>) -> anyhow::Result<StepRange> {
        let last = self.to.unwrap_or(u64::MAX);
        let Some(from) = self.from else { return Ok(StepRange { start: 0, last }) };
        if from > last {
            bail!("--from {from} is after --to {last}");
        }
        let place = find_state(log, Wanted::UpTo(from));
        let place = place.map_err(|error| lacks_state(&self.file, error))?;
        Ok(StepRange { start: place.keyframe_step, last })
    }

    /// Says why the simulation did not start at the first step that was asked for.
    fn start_text(&self, report: &VerifyReport) -> Option<String> {
        let first = report.first_step;
        if let Some(from) = self.from {
            return (first < from).then(|| {
                format!("\nstarted at step {first}, the last complete state up to --from {from}")
            });
        }
        let StepGap { from, to } = report.skipped?;
        Some(format!("\nnot compared: steps {from}..={to}, before the first complete state"))
    }

    /// Returns the report for people.
    fn text(&self, report: &VerifyReport) -> String {
        let lost = report.lost.iter().map(|(topic, count)| format!("\nmissing: {topic} {count}"));
        let gaps = report.gaps.iter().map(|gap| format!("\ngap: steps {}..={}", gap.from, gap.to));
        let start = self.start_text(report).unwrap_or_default();
        let [gaps, lost]: [String; 2] = [gaps.collect(), lost.collect()];
        let mut text = format!("{report}{start}{gaps}{lost}");
        if self.verbose {
            let lines =
                report.not_covered.iter().map(|what| format!("\n  {}", printable_line(what)));
            text += &format!("\nnot compared:{}", lines.collect::<String>());
        }
        text
    }
}
