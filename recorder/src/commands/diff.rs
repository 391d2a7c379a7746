//! `recorder diff`: shows where two recordings come apart, and how their distance grows.

mod comparison;
mod report;

use std::path::{Path, PathBuf};

use anyhow::Context;
use recording::{FileSource, FrameReader, LogEnd, LogReader};
use sim_host::Stop;

use crate::cli::damaged_input::lacks;
use crate::cli::output::{self, AsJson, Exit, progress_spinner};
use comparison::Comparison;

/// Compared steps between two updates of the progress.
const STEPS_PER_UPDATE: u64 = 256;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Compares the scenes, the commands that act on states, and every bit of the particles in the steps that both \
    files have. The distance of two states is the greatest distance of a particle's two positions.\n\n\
    Exit codes: 0 equal in all common steps; 1 failed, or different numbers of particles; 3 different, or a file truncated or damaged.\n\nExamples:\n  \
    recorder diff run.mcap changed.mcap\n  \
    recorder diff run.mcap changed.mcap --json"
)]
pub(crate) struct DiffArgs {
    /// First recording
    a: PathBuf,
    /// Second recording
    b: PathBuf,
    #[command(flatten)]
    as_json: AsJson,
}

pub(crate) fn run(args: &DiffArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let (a, b) = (open(&args.a, &stop)?, open(&args.b, &stop)?);
    let bar = progress_spinner();
    let mut comparison = Comparison::new(a, b);
    let ends = comparison.run(|step| {
        if step.is_multiple_of(STEPS_PER_UPDATE) {
            bar.set_message(format!("step {step}"));
        }
    })?;
    bar.finish_and_clear();
    let paths = [&args.a, &args.b];
    let report = comparison.report().map_err(|error| {
        let damaged = paths.into_iter().zip(&ends).find(|(_, end)| **end != LogEnd::Complete);
        match damaged {
            Some((path, end)) => lacks(path, &format!("{error:#}"), Some(end)),
            None => error,
        }
    })?;
    output::result(args.as_json, &report, &report.to_string())?;
    let mut is_complete = true;
    for (path, end) in paths.into_iter().zip(ends) {
        if end != LogEnd::Complete {
            output::warn_incomplete(path, &end, "compared as far as it goes");
            is_complete = false;
        }
    }
    Ok(if report.first.is_none() && is_complete { Exit::Done } else { Exit::Loss })
}

/// Opens a recording with the content that a comparison needs.
fn open(path: &Path, stop: &Stop) -> anyhow::Result<FrameReader<FileSource>> {
    let opened = || -> anyhow::Result<_> {
        let log = LogReader::open_until(path, stop)?;
        log.selection().require_all_particles("`recorder diff`")?;
        Ok(FrameReader::new(log))
    };
    opened().with_context(|| output::path_text(path))
}
