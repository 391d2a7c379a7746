//! The report that `record` prints at its end.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use recording::{AllCounts, Closing, Topic, counted};
use serde::Serialize;

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
