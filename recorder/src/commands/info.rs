//! `recorder info`: the content of a recording.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::Read;
use std::path::PathBuf;

use anyhow::Context;
use recorder::{Closing, GapCounter, LogEnd, LogReader, RunDescription, Topic};
use serde::Serialize;
use sim_contract::printable_line;

use crate::cli::exit::Exit;
use crate::cli::output::{self, AsJson};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit codes: 0 complete; 1 not a recording; 3 messages lost, or file truncated \
    or damaged.\n\nExamples:\n  \
    recorder info run.mcap\n  \
    recorder info run.mcap --json"
)]
pub(crate) struct InfoArgs {
    /// Recording to read. Every checksum is verified
    file: PathBuf,
    #[command(flatten)]
    as_json: AsJson,
}

/// The content of a recording, as printed.
#[derive(Debug, Serialize)]
pub(crate) struct Info {
    file: String,
    size_bytes: u64,
    /// "complete", "truncated ..." or "damaged ...".
    file_end: String,
    scene: String,
    particle_count: u32,
    constraint_count: u32,
    rate_hz: u32,
    method: &'static str,
    /// 16 hex digits.
    run_id: String,
    solver_version: u32,
    contract_version: u32,
    recorder_version: String,
    first_step: Option<u64>,
    last_step: Option<u64>,
    #[serde(skip)]
    snapshot_count: u64,
    /// From the first to the last snapshot, in simulated seconds.
    duration_s: f64,
    /// Number of messages in the file, by topic.
    messages: BTreeMap<&'static str, u64>,
    /// Messages that the recorder lost or that never reached it, for topics with such messages, and
    /// "unreadable" ones. In a file without an end, only those that are missing between recorded ones.
    lost: BTreeMap<&'static str, u64>,
    /// Topics with an unknown number of missing messages: those of the snapshots in a file without an end,
    /// of a format that does not number them.
    lost_unknown: Vec<&'static str>,
    /// Reason why the recorder stopped. Absent if it was killed.
    stop_reason: Option<String>,
}

pub(crate) fn run(args: &InfoArgs) -> anyhow::Result<Exit> {
    let path = output::path_text(&args.file);
    let mut log = LogReader::open(&args.file).with_context(|| path.clone())?;
    let size_bytes = fs::metadata(&args.file).with_context(|| path.clone())?.len();
    let (info, end) = inspect(&mut log, path.clone(), size_bytes).with_context(|| path.clone())?;
    output::result(args.as_json, &info, &info.to_string())?;
    if end != LogEnd::Complete {
        output::warn_incomplete(&args.file, &end, "read as far as it goes");
    }
    Ok(if end == LogEnd::Complete && info.lost.is_empty() { Exit::Done } else { Exit::Loss })
}

/// Reads the whole recording.
pub(crate) fn inspect<R: Read>(
    log: &mut LogReader<R>,
    file: String,
    size_bytes: u64,
) -> Result<(Info, LogEnd), recorder::ReadError> {
    let mut info = Info::new(log.run(), file, size_bytes);
    let selection = log.selection();
    let mut gaps = GapCounter::for_selection(selection);
    let has_all_particles = selection.has_topic(Topic::Particles) && !selection.is_only_commands();
    // A header at the end of a truncated file has lost its particles.
    let counted = if has_all_particles { Topic::Particles } else { Topic::Steps };
    while let Some(logged) = log.next_message()? {
        gaps.add(&logged.message);
        *info.messages.entry(logged.message.topic().name()).or_default() += 1;
        if logged.message.topic() == counted {
            let step = logged.message.step();
            info.first_step.get_or_insert(step);
            info.last_step = Some(step);
            info.snapshot_count += 1;
        }
    }
    info.messages.insert(Topic::Tf.name(), log.transform_count());
    let end = log.end().cloned().unwrap_or(LogEnd::Complete);
    info.file_end = end.to_string();
    if let (Some(first), Some(last)) = (info.first_step, info.last_step) {
        info.duration_s = last.saturating_sub(first) as f64 / f64::from(info.rate_hz);
    }
    info.count_lost(log.closing(), &gaps);
    Ok((info, end))
}

impl Info {
    fn new(run: &RunDescription, file: String, size_bytes: u64) -> Self {
        Self {
            file,
            size_bytes,
            file_end: String::new(),
            scene: run.scene_name.clone(),
            particle_count: run.particle_count,
            constraint_count: run.constraint_count,
            rate_hz: run.rate_hz,
            method: run.method_name(),
            run_id: format!("{:016x}", run.run_id),
            solver_version: run.solver_version,
            contract_version: run.contract_version,
            recorder_version: run.recorder_version.clone(),
            first_step: None,
            last_step: None,
            snapshot_count: 0,
            duration_s: 0.0,
            messages: Topic::ALL.map(|topic| (topic.name(), 0)).into(),
            lost: BTreeMap::new(),
            lost_unknown: Vec::new(),
            stop_reason: None,
        }
    }

    /// Sets the losses: those that the end of the file states, or more if the file shows more.
    fn count_lost(&mut self, closing: Option<&Closing>, gaps: &GapCounter) {
        if closing.is_none() && gaps.has_unnumbered_snapshots() {
            self.lost_unknown = [Topic::Steps, Topic::Particles].map(Topic::name).to_vec();
        }
        let shown = gaps.counts();
        self.stop_reason = closing.map(|closing| closing.stop_reason.clone());
        self.lost = closing.map(Closing::missing).unwrap_or_default();
        for (topic, shown) in shown.iter().filter(|(_, shown)| shown.gaps > 0) {
            let lost = self.lost.entry(topic.name()).or_default();
            *lost = shown.gaps.max(*lost);
        }
    }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let join = |counts: &BTreeMap<&str, u64>| {
            let parts = counts.iter().filter(|(_, count)| **count > 0);
            parts.map(|(topic, count)| format!("{topic} {count}")).collect::<Vec<_>>().join(", ")
        };
        let none_if_empty = |text: String| if text.is_empty() { "none".to_owned() } else { text };
        let (file, file_end) = (printable_line(&self.file), printable_line(&self.file_end));
        writeln!(f, "file        {file}, {} bytes, {file_end}", self.size_bytes)?;
        writeln!(
            f,
            "scene       {}: {}, {}, {} Hz, {}",
            printable_line(&self.scene),
            counted(self.particle_count, "particle"),
            counted(self.constraint_count, "constraint"),
            self.rate_hz,
            self.method
        )?;
        writeln!(
            f,
            "run         {} (solver version {}, contract version {}, recorder {})",
            self.run_id,
            self.solver_version,
            self.contract_version,
            printable_line(&self.recorder_version)
        )?;
        match (self.first_step, self.last_step) {
            (Some(first), Some(last)) => {
                let (count, duration_s) = (self.snapshot_count, self.duration_s);
                writeln!(f, "steps       {first}..={last}, {count} recorded, {duration_s:.3} s")?;
            }
            _ => writeln!(f, "steps       none")?,
        }
        writeln!(f, "messages    {}", none_if_empty(join(&self.messages)))?;
        let scope = if self.stop_reason.is_none() { ", as far as the file goes" } else { "" };
        let unknown = self.lost_unknown.iter().map(|topic| format!("{topic} unknown"));
        let known = Some(join(&self.lost)).filter(|known| !known.is_empty());
        let lost = unknown.chain(known).collect::<Vec<_>>().join(", ");
        writeln!(f, "lost        {}{scope}", none_if_empty(lost))?;
        let reason = self.stop_reason.as_deref().unwrap_or("unknown");
        write!(f, "stopped     {}", printable_line(reason))
    }
}

/// Returns a number with its noun, such as "1 particle" or "2 particles".
fn counted(count: u32, noun: &str) -> String {
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use recorder::{LogOptions, LogWriter, Message, StepRow, Up};

    use super::*;

    /// Returns the report on a file with two snapshots.
    fn report(indices: [Option<u32>; 2], closing: Option<&Closing>) -> (Info, String) {
        let run = RunDescription {
            run_id: 7,
            epoch_ns: 0,
            scene_name: "points".to_owned(),
            origin: [0.0; 3],
            up: Up::Y,
            rate_hz: 240,
            method: 0,
            particle_count: 0,
            constraint_count: 0,
            solver_version: 1,
            contract_version: 1,
            recorder_version: "0".to_owned(),
        };
        let mut bytes = Vec::new();
        let mut log =
            LogWriter::create(&mut bytes, LogOptions::default(), &run, b"version = 1", 0).unwrap();
        for (step, snapshot_index) in (0..).zip(indices) {
            let row = StepRow { step, snapshot_index, ..StepRow::default() };
            log.write(&Message::Step(row), 0).unwrap();
        }
        log.flush().unwrap();
        if let Some(closing) = closing {
            log.finish(closing).unwrap();
        } else {
            drop(log);
        }
        let mut log = LogReader::new(bytes.as_slice()).unwrap();
        let (info, _) = inspect(&mut log, "run.mcap".to_owned(), 0).unwrap();
        let text = info.to_string();
        let lost = text.lines().find(|line| line.starts_with("lost")).unwrap().to_owned();
        (info, lost)
    }

    #[test]
    fn every_message_of_the_file_is_counted() {
        let (info, _) = report([Some(0), Some(1)], None);
        assert_eq!((info.messages["/tf"], info.messages["/steps"]), (1, 2));
        assert_eq!(info.messages.values().sum::<u64>(), 3);
    }

    #[test]
    fn the_losses_of_a_file_without_an_end_are_unknown_if_its_snapshots_have_no_numbers() {
        let (info, lost) = report([None, None], None);
        assert_eq!(info.lost_unknown, ["/steps", "/particles"]);
        assert_eq!(lost, "lost        /steps unknown, /particles unknown, as far as the file goes");
        let (_, lost) = report([Some(4), Some(5)], None);
        assert_eq!(lost, "lost        none, as far as the file goes");
        let (_, lost) = report([Some(4), Some(6)], None);
        assert_eq!(lost, "lost        /particles 1, /steps 1, as far as the file goes");
        let (_, lost) = report([None, None], Some(&Closing::default()));
        assert_eq!(lost, "lost        none");
    }
}
