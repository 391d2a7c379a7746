//! The progress of a recording, on a terminal and for a program, and the report at its end.

use std::collections::BTreeMap;
use std::fmt;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use recording::{AllCounts, Closing, Topic, counted};
use serde::Serialize;
use sim_host::clock::{SECOND_NS, monotonic_ns};
use sim_host::console;

use super::queue::Queue;
use super::split::WritePosition;
use super::splitter::Splitter;
use crate::cli::output;

/// The files that a recording has written.
#[derive(Debug, Default)]
pub(crate) struct Written {
    /// The newest file.
    last_path: PathBuf,
    file_count: u64,
    /// Number of files that the ring has removed, including files of earlier recordings.
    pub(crate) removed_count: u64,
    /// The counts of all files, added up.
    total: Closing,
    /// First and last recorded step.
    steps: Option<(u64, u64)>,
}

impl Written {
    /// Adds a finished file, with its first and last recorded step.
    pub(crate) fn add(&mut self, path: PathBuf, closing: &Closing, steps: Option<(u64, u64)>) {
        self.last_path = path;
        self.file_count += 1;
        self.total.counts.add(&closing.counts);
        self.total.unreadable += closing.unreadable;
        if let Some((first, last)) = steps {
            self.steps = Some((self.steps.map_or(first, |(first, _)| first), last));
        }
    }

    /// Adds missing messages that no file declares.
    pub(crate) fn add_undeclared(&mut self, counts: &AllCounts) {
        self.total.counts.add(counts);
    }

    /// Describes a finished file in a line.
    pub(crate) fn file_line(path: &Path, closing: &Closing, steps: Option<(u64, u64)>) -> String {
        let count = closing.counts[Topic::Steps].written;
        let steps = steps.map_or_else(|| "no step".to_owned(), |(a, b)| format!("steps {a}..={b}"));
        let missing: Vec<_> =
            closing.missing().iter().map(|one| format!("{} {}", one.0, one.1)).collect();
        let lost = if missing.is_empty() { "none".to_owned() } else { missing.join(", ") };
        let (path, reason) = (output::path_text(path), &closing.stop_reason);
        format!("written {path}: {steps}, {count} recorded, lost {lost} ({reason})")
    }
}

/// The report, for one file or the sum of several.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    /// The newest file, if there is one.
    output: Option<String>,
    /// Number of written files, including files that the ring has removed again.
    files: u64,
    /// Number of files that the ring has removed, including files of earlier recordings.
    removed_files: u64,
    first_step: Option<u64>,
    last_step: Option<u64>,
    /// Number of recorded snapshots.
    snapshots: u64,
    /// Number of recorded outcomes.
    outcomes: u64,
    /// Number of missing messages by topic, and of messages that could not be read as "unreadable".
    lost: BTreeMap<&'static str, u64>,
    /// The part of the lost snapshots that came before the first keyframe.
    before_first_keyframe: u64,
    stop_reason: String,
}

impl Report {
    /// Reports the files, for which `before_first_keyframe` snapshots came too early.
    pub(crate) fn new(written: &Written, before_first_keyframe: u64, stop_reason: String) -> Self {
        let counts = &written.total.counts;
        Self {
            output: (written.file_count > 0).then(|| output::path_text(&written.last_path)),
            files: written.file_count,
            removed_files: written.removed_count,
            first_step: written.steps.map(|(first, _)| first),
            last_step: written.steps.map(|(_, last)| last),
            snapshots: counts[Topic::Steps].written,
            outcomes: counts[Topic::Outcomes].written,
            lost: written.total.missing(),
            before_first_keyframe,
            stop_reason,
        }
    }

    /// Returns `true` if a file was written.
    pub(crate) fn has_files(&self) -> bool {
        self.files > 0
    }

    /// Returns `true` if every published message was recorded.
    pub(crate) fn is_complete(&self) -> bool {
        self.lost.is_empty()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.output {
            Some(path) => writeln!(f, "written     {path}")?,
            // Only a black box can end so.
            None => {
                writeln!(f, "written     nothing: no mark, tear, frozen particle or SIGUSR1 came")?;
            }
        }
        if self.files > 1 || self.removed_files > 0 {
            let (files, removed) = (self.files, self.removed_files);
            writeln!(f, "files       {files} written, {removed} removed")?;
        }
        let snapshots = self.snapshots;
        match (self.first_step, self.last_step) {
            (Some(first), Some(last)) => {
                writeln!(f, "steps       {first}..={last}, {snapshots} recorded")?;
            }
            _ => writeln!(f, "steps       none")?,
        }
        writeln!(f, "outcomes    {}", self.outcomes)?;
        if self.lost.is_empty() {
            writeln!(f, "lost        none")?;
        }
        for (topic, count) in &self.lost {
            writeln!(f, "lost        {topic} {count}")?;
        }
        if self.before_first_keyframe > 0 {
            let snapshots = counted(self.before_first_keyframe, "snapshot");
            writeln!(f, "of these    {snapshots} before the first keyframe")?;
        }
        write!(f, "stopped     {}", self.stop_reason)
    }
}

/// Time from one update to the next.
const PERIOD_NS: u64 = SECOND_NS / 4;
/// Time over which the speed is measured: several flushes.
const SPEED_PERIOD_NS: u64 = 3 * SECOND_NS;
const BYTES_PER_MB: f64 = 1e6;

/// A line of JSON about a recording in progress.
#[derive(Debug, PartialEq, Serialize)]
struct Progress {
    /// Time since the start, in s.
    seconds: f64,
    /// Number of the newest file, from 0, which the next fields describe.
    file: u64,
    /// Number of snapshots in the newest file, of which some can wait in the queue.
    snapshots: u64,
    /// Size of the newest file so far, without its open chunk.
    size_bytes: u64,
    /// Number of missing messages of the newest file, for topics that have any, and "unreadable" ones.
    lost: BTreeMap<&'static str, u64>,
}

/// Shows a line, and replaces it four times a second.
#[derive(Debug)]
pub(super) struct LiveLine {
    queue: Arc<Queue>,
    position: Arc<WritePosition>,
    /// Also prints lines of JSON on stdout.
    has_progress: bool,
    begin_ns: u64,
    next_ns: u64,
    last: Sample,
    bytes_per_s: f64,
}

/// The place in the files at a time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Sample {
    monotonic_ns: u64,
    file_number: u64,
    size_bytes: u64,
}

impl LiveLine {
    pub(super) fn new(queue: Arc<Queue>, position: Arc<WritePosition>, has_progress: bool) -> Self {
        let now_ns = monotonic_ns();
        let last = Sample { monotonic_ns: now_ns, ..Sample::default() };
        Self {
            queue,
            position,
            has_progress,
            begin_ns: now_ns,
            next_ns: now_ns + PERIOD_NS,
            last,
            bytes_per_s: 0.0,
        }
    }

    /// Replaces the line if it is time to. Returns `false` if the reader of the lines of JSON has gone.
    pub(super) fn update(&mut self, splitter: &Splitter) -> anyhow::Result<bool> {
        let now_ns = monotonic_ns();
        if now_ns < self.next_ns {
            return Ok(true);
        }
        self.next_ns = now_ns + PERIOD_NS;
        let (file_number, size_bytes) = self.position.get().unwrap_or_default();
        let now = Sample { monotonic_ns: now_ns, file_number, size_bytes };
        if now_ns - self.last.monotonic_ns >= SPEED_PERIOD_NS {
            self.bytes_per_s = bytes_per_s(self.last, now);
            self.last = now;
        }
        let seconds = (now_ns - self.begin_ns) as f64 / SECOND_NS as f64;
        if splitter.is_of_black_box() {
            output::show_live(black_box_text(seconds, size_bytes, file_number));
            return Ok(true);
        }
        let closing = splitter.closing();
        output::show_live(text(seconds, &closing, self.bytes_per_s, self.queue.size_bytes()));
        if !self.has_progress {
            return Ok(true);
        }
        let progress = Progress::new(seconds, splitter.file_number(), &closing, size_bytes);
        let line = format!("{}\n", serde_json::to_string(&progress)?);
        console::write_part(line.as_bytes()).context("cannot write to stdout")
    }
}

impl Progress {
    fn new(seconds: f64, file: u64, closing: &Closing, size_bytes: u64) -> Self {
        let snapshots = closing.counts[Topic::Steps].received;
        Self { seconds, file, snapshots, size_bytes, lost: closing.missing() }
    }
}

/// Speed of the writing thread. In a new file, only what is in it counts.
fn bytes_per_s(last: Sample, now: Sample) -> f64 {
    let before = if last.file_number == now.file_number { last.size_bytes } else { 0 };
    let seconds = (now.monotonic_ns - last.monotonic_ns).max(1) as f64 / SECOND_NS as f64;
    now.size_bytes.saturating_sub(before) as f64 / seconds
}

fn text(seconds: f64, closing: &Closing, bytes_per_s: f64, queue_bytes: usize) -> String {
    let snapshots = counted(closing.counts[Topic::Steps].received, "snapshot");
    let speed = bytes_per_s / BYTES_PER_MB;
    let queue = queue_bytes as f64 / BYTES_PER_MB;
    let mut text = format!(
        "{seconds:.1} s, {snapshots} in this file, {speed:.1} MB/s, {queue:.1} MB in the queue, lost"
    );
    let missing = closing.missing();
    if missing.is_empty() {
        text += " none";
    }
    for (topic, count) in missing {
        // Writing to a text cannot fail.
        let _ = write!(text, " {topic} {count}");
    }
    text
}

/// The line of a black box, with the number of files that it has written.
fn black_box_text(seconds: f64, kept_bytes: u64, file_count: u64) -> String {
    let kept = kept_bytes as f64 / BYTES_PER_MB;
    let files = counted(file_count, "file");
    format!("{seconds:.1} s, {kept:.1} MB kept, {files} written")
}

#[cfg(test)]
mod live_tests {
    use super::*;

    #[test]
    fn the_line_has_the_time_the_speed_the_queue_and_the_losses() {
        let mut closing = Closing::default();
        closing.counts[Topic::Steps].received = 240;
        let line = text(1.04, &closing, 5_260_000.0, 120_000);
        assert_eq!(
            line,
            "1.0 s, 240 snapshots in this file, 5.3 MB/s, 0.1 MB in the queue, lost none"
        );
        closing.counts[Topic::Steps].lost = 3;
        closing.counts[Topic::Particles].gaps = 3;
        let line = text(1.04, &closing, 0.0, 0);
        assert!(line.ends_with("lost /particles 3 /steps 3"), "{line}");
    }

    #[test]
    fn a_line_of_json_has_the_time_the_size_and_the_losses() {
        let mut closing = Closing::default();
        closing.counts[Topic::Steps].received = 240;
        closing.counts[Topic::Particles].lost = 3;
        let line = serde_json::to_string(&Progress::new(1.25, 2, &closing, 4096)).unwrap();
        assert_eq!(
            line,
            r#"{"seconds":1.25,"file":2,"snapshots":240,"size_bytes":4096,"lost":{"/particles":3}}"#
        );
    }

    #[test]
    fn the_speed_counts_a_new_file_from_its_start() {
        let at = |monotonic_ns, file_number, size_bytes| Sample {
            monotonic_ns,
            file_number,
            size_bytes,
        };
        assert!((bytes_per_s(at(0, 0, 100), at(SECOND_NS / 2, 0, 400)) - 600.0).abs() < 1e-9);
        assert!((bytes_per_s(at(0, 0, 900), at(SECOND_NS, 1, 50)) - 50.0).abs() < 1e-9);
    }
}
