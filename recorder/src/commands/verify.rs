//! `recorder verify`: proves that a recording re-simulates bit for bit, and reports
//! the messages that it lacks.

mod coverage;
pub(crate) mod difference;
mod events;
pub(crate) mod finding;
mod load;
mod past_states;
mod read_ahead;
pub(crate) mod resimulation;
mod side_rows;
mod snapshot_numbers;
mod verification;

use std::collections::BTreeMap;
use std::fmt;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::thread;

use anyhow::{Context, bail};
use recorder::{LogEnd, LogReader};
use serde::Serialize;
use sim_contract::{Stop, printable_line};

use crate::cli::damaged_input::lacks;
use crate::cli::exit::Exit;
use crate::cli::output::{self, AsJson};
use crate::cli::parse::whole_number;
use crate::cli::progress::progress_bytes;
use crate::cli::thread_args::ThreadArgs;
use crate::input::scene_source::scene_to_simulate;
use crate::input::state_place::{Wanted, find_state};
use difference::Difference;
use finding::{Finding, StepGap};
pub(crate) use verification::{StepRange, VerifyOptions};
use verification::{Verification, VerifyError, check_header};

/// Snapshots between two updates of the progress bar.
const SNAPSHOTS_PER_UPDATE: u64 = 64;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Compares everything that a recorder writes, also where the checksums are gone, \
    and lists the messages that are missing and the content that nothing else in the file can \
    contradict. Behind missing outcomes, it goes on from the next complete state.\n\n\
    Exit codes: 0 every recorded step is bit-identical; 1 not verifiable; 3 different, outcomes missing, or file truncated \
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
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// The result of the verification, as printed.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) verdict: Verdict,
    /// The step from which the simulation started.
    pub(crate) first_step: u64,
    /// The last bit-identical step, if there is one.
    pub(crate) last_identical_step: Option<u64>,
    /// Number of simulated and compared steps.
    pub(crate) steps_identical: u64,
    /// The step that the verdict concerns.
    pub(crate) step: Option<u64>,
    pub(crate) what: Option<String>,
    /// Steps whose states could not be simulated, because outcomes are missing.
    pub(crate) gaps: Vec<StepGap>,
    #[serde(flatten)]
    pub(crate) difference: Option<Difference>,
    /// The end of the file.
    pub(crate) file_end: String,
    /// Number of messages that the recording lacks, for topics with such messages, and "unreadable"
    /// ones.
    pub(crate) lost: BTreeMap<&'static str, u64>,
    /// The content that is not compared.
    pub(crate) not_covered: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    Identical,
    Diverged,
    OutcomeLogIncomplete,
    Interrupted,
}

pub(crate) fn run(args: &VerifyArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let path = output::path_text(&args.file);
    let open = || LogReader::open_until(&args.file, &stop).with_context(|| path.clone());
    let range = args.range(open)?;
    let size_bytes = std::fs::metadata(&args.file).map_or(0, |file| file.len());
    let bar = progress_bytes(size_bytes);
    let options = VerifyOptions { threads: args.threads.count(), range };
    let (report, end) =
        verify(open()?, &path, options, stop.flag(), |bytes| bar.set_position(bytes))?;
    bar.finish_and_clear();
    args.check_range(&report).with_context(|| path.clone())?;
    output::result(args.as_json, &report, &report.text())?;
    if let Some(end) = &end {
        output::warn_incomplete(&args.file, end, "verified as far as it goes");
    }
    Ok(match report.verdict {
        Verdict::Interrupted => Exit::Failed,
        Verdict::Identical if end.is_none() => Exit::Done,
        _ => Exit::Loss,
    })
}

impl VerifyArgs {
    /// Refuses a range that begins after the last step: nothing of it was compared.
    fn check_range(&self, report: &Report) -> anyhow::Result<()> {
        match (self.from, report.last_identical_step) {
            (Some(from), Some(last)) if from > last && report.verdict == Verdict::Identical => {
                bail!("--from {from} is after its last step, {last}")
            }
            _ => Ok(()),
        }
    }

    /// Returns the steps to compare, with the one to start from.
    fn range<R: Read>(
        &self,
        open: impl FnOnce() -> anyhow::Result<LogReader<R>>,
    ) -> anyhow::Result<StepRange> {
        let last = self.to.unwrap_or(u64::MAX);
        let Some(from) = self.from else { return Ok(StepRange { start: 0, last }) };
        if from > last {
            bail!("--from {from} is after --to {last}");
        }
        let place = find_state(&self.file, open()?, Wanted::UpTo(from));
        let place = place.with_context(|| output::path_text(&self.file))?;
        Ok(StepRange { start: place.keyframe_step, last })
    }
}

/// Re-simulates a recording. Calls `on_progress` periodically, with the number of bytes that are read.
/// Ends early, even within a step, if `stop` becomes true.
pub(crate) fn verify<R: Read + Send>(
    log: LogReader<R>,
    path: &str,
    options: VerifyOptions,
    stop: &AtomicBool,
    on_progress: impl FnMut(u64),
) -> anyhow::Result<(Report, Option<LogEnd>)> {
    let scene = scene_to_simulate(&log, "`recorder verify`").with_context(|| path.to_owned())?;
    let log = log.with_audit();
    let header = check_header(&log, &scene);
    // The reading thread ends when the verification is dropped, at the latest after its batch.
    thread::scope(|threads| {
        let verification = Verification::start(threads, log, scene, options);
        let verification = verification.with_context(|| path.to_owned())?;
        report(verification, header, path, stop, on_progress)
    })
}

/// Compares the states, unless the header differs, and returns the report.
fn report(
    mut verification: Verification,
    header: Finding,
    path: &str,
    stop: &AtomicBool,
    on_progress: impl FnMut(u64),
) -> anyhow::Result<(Report, Option<LogEnd>)> {
    let mut report = Report::new();
    match header {
        Finding::Identical => {
            compare_states(&mut verification, &mut report, stop, on_progress)
                .with_context(|| path.to_owned())?;
            report.gaps = verification.gaps();
        }
        finding => _ = report.add(finding, 0),
    }
    let end = verification.frames.seen.end.clone().filter(|end| *end != LogEnd::Complete);
    if verification.simulation.is_none() && report.verdict == Verdict::Identical {
        if let Some(last) = verification.coverage.last_step {
            bail!("{path}: has no complete state up to step {last} to start from");
        }
        let problem = format!("{path}: has no snapshot with a keyframe to start from");
        return Err(lacks(Path::new(path), &problem, end.as_ref()));
    }
    let end_text = verification.frames.seen.end.as_ref().map(ToString::to_string);
    report.file_end = end_text.unwrap_or_else(|| "not reached".to_owned());
    report.lost = verification.numbers.lost(verification.frames.seen.closing.as_deref());
    report.not_covered = verification.coverage.not_covered();
    Ok((report, end))
}

/// Compares every snapshot, up to the first finding, and then the end of the file.
fn compare_states(
    verification: &mut Verification,
    report: &mut Report,
    stop: &AtomicBool,
    mut on_progress: impl FnMut(u64),
) -> Result<(), VerifyError> {
    let mut count = 0;
    while let Some((step, finding)) = verification.next(stop)? {
        count += 1;
        if count % SNAPSHOTS_PER_UPDATE == 0 {
            on_progress(verification.frames.seen.intact_count);
        }
        if report.is_empty() {
            report.first_step = step;
        }
        if !report.add(finding, step) {
            return Ok(());
        }
    }
    verification.finish_coverage();
    if verification.simulation.is_some() && verification.coverage.last_step.is_none() {
        let finding = verification.check_end();
        report.add_end(finding);
    }
    Ok(())
}

impl Report {
    fn new() -> Self {
        Self {
            verdict: Verdict::Identical,
            first_step: 0,
            last_identical_step: None,
            steps_identical: 0,
            step: None,
            what: None,
            gaps: Vec::new(),
            difference: None,
            file_end: String::new(),
            lost: BTreeMap::new(),
            not_covered: Vec::new(),
        }
    }

    /// Returns the report for people, with the content that is not compared.
    fn text(&self) -> String {
        let lines = self.not_covered.iter().map(|what| format!("\n  {}", printable_line(what)));
        let lost = self.lost.iter().map(|(topic, count)| format!("\nmissing: {topic} {count}"));
        let gaps = self.gaps.iter().map(|gap| format!("\ngap: steps {}..={}", gap.from, gap.to));
        let (gaps, lost) = (gaps.collect::<String>(), lost.collect::<String>());
        format!("{self}{gaps}{lost}\nnot compared:{}", lines.collect::<String>())
    }

    /// Returns `true` before the first snapshot is compared.
    fn is_empty(&self) -> bool {
        self.last_identical_step.is_none()
    }

    /// Adds the finding at the end of the file.
    fn add_end(&mut self, finding: Finding) {
        if finding != Finding::Identical {
            self.add(finding, 0);
        }
    }

    /// Adds the finding at `step`. Returns `true` to continue.
    fn add(&mut self, finding: Finding, step: u64) -> bool {
        match finding {
            Finding::NotCompared => return true,
            Finding::Identical => {
                self.last_identical_step = Some(step);
                self.steps_identical += u64::from(step != self.first_step);
                return true;
            }
            Finding::Diverged { step, what, difference } => {
                self.verdict = Verdict::Diverged;
                (self.step, self.what, self.difference) = (Some(step), Some(what), difference);
            }
            Finding::OtherContent { what } => {
                self.verdict = Verdict::Diverged;
                (self.step, self.what) = (None, Some(what));
            }
            Finding::Interrupted => self.verdict = Verdict::Interrupted,
            // The report names the first one.
            Finding::Incomplete { .. } if self.verdict == Verdict::OutcomeLogIncomplete => {
                return true;
            }
            Finding::Incomplete { step, what } => {
                self.verdict = Verdict::OutcomeLogIncomplete;
                (self.step, self.what) = (Some(step), Some(what));
                return true;
            }
        }
        false
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.steps_identical;
        let what = printable_line(self.what.as_deref().unwrap_or(""));
        let step = self.step.unwrap_or(0);
        match self.verdict {
            Verdict::Identical => {
                let last = self.last_identical_step.unwrap_or(self.first_step);
                write!(f, "{count} steps bit-identical ({}..={last})", self.first_step)
            }
            Verdict::Diverged if self.step.is_none() => {
                write!(f, "the file differs: {what} ({count} steps bit-identical)")
            }
            Verdict::Diverged => {
                write!(f, "step {step} differs: {what} ({count} steps before it bit-identical)")
            }
            Verdict::OutcomeLogIncomplete => write!(
                f,
                "outcome log incomplete from step {step}: {what} ({count} other steps bit-identical)"
            ),
            Verdict::Interrupted => write!(f, "interrupted; {count} steps so far bit-identical"),
        }
    }
}
