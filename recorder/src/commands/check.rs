//! `recorder check`: tests every byte of recordings.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::Context;
use recording::{
    CheckExtent, CheckReport, Finding, ReadError, check_file, counted, open_regular_file,
};
use serde::Serialize;
use sim_contract::printable_line;
use sim_host::Stop;

use crate::cli::output::{self, AsJson, Exit, progress_bytes};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Tests the structure of the file, all checksums, the index, the order and the times of \
    messages, missing steps against those that the file declares, that all numbers are finite, and the hash \
    of each snapshot against its bytes. It goes on behind damage. It does not simulate: `recorder verify` \
    proves that the states follow from the scene and the commands.\n\n\
    Exit codes: 0 sound; 1 not readable as a recording; 3 something was found.\n\nExamples:\n  \
    recorder check run.mcap\n  \
    recorder check --json *.mcap"
)]
pub(crate) struct CheckArgs {
    /// Recordings to test
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    as_json: AsJson,
}

/// The result for a file, as printed.
#[derive(Debug, Serialize)]
struct FileReport<'a> {
    file: &'a str,
    is_sound: bool,
    /// Number of findings, those that are not listed included.
    finding_count: u64,
    findings: &'a [Finding],
    #[serde(flatten)]
    extent: &'a CheckExtent,
}

pub(crate) fn run(args: &CheckArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let mut worst = Exit::Done;
    for file in &args.files {
        match check(file, args.as_json, &stop) {
            Ok(false) if worst == Exit::Done => worst = Exit::Loss,
            Ok(_) => {}
            Err(error) if stop.is_requested() => return Err(error),
            Err(error) => {
                output::note(&format!("error: {error:#}"));
                worst = Exit::Failed;
            }
        }
    }
    Ok(worst)
}

/// Checks a file and prints the result. Returns `true` if it is sound.
fn check(file: &Path, as_json: AsJson, stop: &Stop) -> anyhow::Result<bool> {
    let path = output::path_text(file);
    let source = open_regular_file(file).map_err(ReadError::from).with_context(|| path.clone())?;
    let bar = progress_bytes(0);
    let report = check_file(source, Some(stop), &mut |at, size_bytes| {
        bar.set_length(size_bytes);
        bar.set_position(at);
    })
    .with_context(|| path.clone())?;
    bar.finish_and_clear();
    let CheckReport { findings, extent } = &report;
    let report = FileReport {
        file: &path,
        is_sound: findings.count() == 0,
        finding_count: findings.count(),
        findings: findings.list(),
        extent,
    };
    output::result(as_json, &report, &report.to_string())?;
    Ok(report.is_sound)
}

impl fmt::Display for FileReport<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.finding_count {
            0 => "sound".to_owned(),
            count => counted(count, "finding"),
        };
        let extent = self.extent;
        let file = printable_line(self.file);
        write!(f, "{file}: {verdict}: {}", counted(extent.snapshot_count, "snapshot"))?;
        if let Some([first, last]) = extent.steps {
            write!(f, " (steps {first}..={last})")?;
        }
        let (messages, chunks, bytes) =
            (extent.message_count, extent.chunk_count, extent.size_bytes);
        let [messages, chunks] = [counted(messages, "message"), counted(chunks, "chunk")];
        write!(f, ", {messages}, {chunks}, {bytes} bytes")?;
        if extent.declared_missing > 0 {
            write!(f, "; the file declares {} missing messages", extent.declared_missing)?;
        }
        for finding in self.findings {
            write!(f, "\n  {}", printable_line(&finding.to_string()))?;
        }
        let more = self.finding_count - self.findings.len() as u64;
        if more > 0 {
            write!(f, "\n  {more} more findings")?;
        }
        if self.finding_count > 0 {
            write!(f, "\ncure: recorder repair {file} OUT.mcap")?;
        }
        for what in &extent.not_checked {
            write!(f, "\nnot checked: {}", printable_line(what))?;
        }
        Ok(())
    }
}
