//! `recorder repair`: copies what is intact in a recording.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::path::PathBuf;

use anyhow::Context;
use recording::{
    AfterEnd, Finding, LoadRows, PartFile, ReadError, RepairReport, Topic, counted, load_rows,
    open_regular_file, repair_file,
};
use serde::Serialize;
use sim_contract::printable_line;
use sim_host::{Stop, is_being_written};

use crate::cli::args::{OverwriteArgs, refuse_own_input};
use crate::cli::output::{self, AsJson, Exit, progress_bytes};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Skips damaged parts and goes on behind them. A chunk is kept if its checksum is right, a \
    message if it passes `recorder check`, a snapshot with its row or not at all. Writes a new index, and \
    declares what is missing: by topic in the metadata 'recorder', by ranges of steps in the metadata \
    'repair'. The result passes `recorder check`. IN is never changed.\n\n\
    Exit codes: 0 nothing is missing; 1 not repairable, or not written; 3 parts are missing.\n\nExamples:\n  \
    recorder repair run.mcap.part repaired.mcap\n  \
    recorder repair damaged.mcap repaired.mcap --overwrite --json"
)]
pub(crate) struct RepairArgs {
    /// Recording to read
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Recording to write
    #[arg(value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// The result, as printed.
#[derive(Debug, Serialize)]
struct Repaired<'a> {
    input: String,
    output: String,
    is_lossless: bool,
    /// The first and the last step of the snapshots in the output.
    steps: Option<[u64; 2]>,
    snapshot_count: u64,
    /// Number of messages that are missing, by topic, as far as the file tells.
    lost: BTreeMap<&'static str, u64>,
    /// Content that damage before the description of the run may have taken.
    lost_head: Option<&'static str>,
    /// Ranges of steps without snapshots.
    lost_steps: Vec<String>,
    /// The losses for people.
    #[serde(skip)]
    missing: Vec<String>,
    /// Topics that were lost, and follow from the scene.
    restored: &'static [&'static str],
    /// The input has its end. Without it, nobody knows what the recorder had not written yet.
    has_end: bool,
    /// Bytes after that end, such as a second file, which the output lacks.
    after_end: Option<&'a AfterEnd>,
    /// The checksum of the data is wrong, and no damaged part explains it.
    is_uncertain: bool,
    finding_count: u64,
    findings: &'a [Finding],
}

pub(crate) fn run(args: &RepairArgs) -> anyhow::Result<Exit> {
    output::warn_of_extension(&args.output, &["mcap"]);
    let stop = Stop::install()?;
    let (input, output) = (output::path_text(&args.input), output::path_text(&args.output));
    let open =
        || open_regular_file(&args.input).map_err(ReadError::from).with_context(|| input.clone());
    refuse_own_input(&open()?, &args.output)?;
    if is_being_written(&args.input) {
        output::note(&format!(
            "warning: {}: a recorder is still writing this file; the repair ends where the file ends now. \
             Repeat it after the recorder has ended",
            printable_line(&input)
        ));
    }
    let (mut file, mut report) = copy(args, open()?, None, &stop)?;
    let load = load_rows(&report);
    let mut restored: &[_] = &[];
    if load.is_some() {
        // It comes before everything that was written.
        file.discard()?;
        (file, report) = copy(args, open()?, load, &stop)?;
        restored = &["/topology", "/surface"];
    }
    file.finish()?;
    let repaired = Repaired { restored, ..Repaired::new(input, output, &report) };
    output::result(args.as_json, &repaired, &repaired.to_string())?;
    Ok(if repaired.is_lossless { Exit::Done } else { Exit::Loss })
}

/// Writes the repaired file, without giving it its name.
fn copy(
    args: &RepairArgs,
    source: File,
    load: Option<LoadRows>,
    stop: &Stop,
) -> anyhow::Result<(PartFile, RepairReport)> {
    let mut file = PartFile::create(&args.output, args.overwrite.existing())?;
    let bar = progress_bytes(0);
    let result = repair_file(source, &mut file, load, Some(stop), &mut |at, size_bytes| {
        bar.set_length(size_bytes);
        bar.set_position(at);
    });
    bar.finish_and_clear();
    match result {
        Ok(report) => Ok((file, report)),
        Err(error) => {
            file.discard()?;
            Err(error).with_context(|| output::path_text(&args.input))
        }
    }
}

impl<'a> Repaired<'a> {
    fn new(input: String, output: String, report: &'a RepairReport) -> Self {
        let losses = &report.losses;
        Self {
            input,
            output,
            is_lossless: losses.is_empty()
                && !report.is_uncertain
                && !report.after_end.as_ref().is_some_and(AfterEnd::has_messages),
            steps: report.steps,
            snapshot_count: report.counts[Topic::Particles].written,
            lost: losses.messages(),
            lost_head: losses.head(),
            lost_steps: losses.steps(),
            missing: losses.lines(),
            restored: &[],
            has_end: report.has_end,
            after_end: report.after_end.as_ref(),
            is_uncertain: report.is_uncertain,
            finding_count: report.findings.count(),
            findings: report.findings.list(),
        }
    }
}

impl Repaired<'_> {
    /// Returns `true` if something is lost, and no topic, step or other name tells what.
    fn has_unknown_loss(&self) -> bool {
        !self.is_lossless
            && !self.is_uncertain
            && self.missing.is_empty()
            && self.after_end.is_none()
    }
}

impl fmt::Display for Repaired<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let output = printable_line(&self.output);
        write!(f, "written     {output}: {}", counted(self.snapshot_count, "snapshot"))?;
        if let Some([first, last]) = self.steps {
            write!(f, " (steps {first}..={last})")?;
        }
        for finding in self.findings {
            let Finding { byte, record, what, .. } = finding;
            write!(f, "\ndamage      byte {byte}: {record}: {}", printable_line(what))?;
        }
        let more = self.finding_count - self.findings.len() as u64;
        if more > 0 {
            write!(f, "\ndamage      {more} more")?;
        }
        if !self.restored.is_empty() {
            write!(f, "\nrestored    {}, from the scene", self.restored.join(", "))?;
        }
        if self.is_uncertain {
            let what = "the checksum of the data is wrong, and no damaged part explains it: a byte outside \
                        of the messages may be wrong";
            write!(f, "\nuncertain   {what}")?;
        }
        if let Some(AfterEnd { byte, size_bytes, message_count, .. }) = self.after_end {
            let cure = format!("`tail -c +{}` writes them to a file of their own", byte + 1);
            write!(
                f,
                "\nafter end   {size_bytes} bytes with {message_count} messages follow the end of the recording and \
                 are not copied: {cure}"
            )?;
        }
        if self.is_lossless && self.has_end {
            return write!(f, "\nmissing     nothing");
        }
        if self.is_lossless {
            let what = "nothing of this file. It has no end: what was not written then is unknown";
            return write!(f, "\nmissing     {what}");
        }
        self.missing.iter().try_for_each(|what| write!(f, "\nmissing     {what}"))?;
        if self.has_unknown_loss() {
            write!(f, "\nmissing     the damaged part, whose content is unknown")?;
        }
        Ok(())
    }
}
