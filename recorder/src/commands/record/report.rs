//! The report that `record` prints at its end.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;
use std::path::Path;

use recorder::{Closing, Topic};
use serde::Serialize;

use crate::cli::output;

#[derive(Debug, Serialize)]
pub(crate) struct Report {
    output: String,
    first_step: u64,
    last_step: u64,
    /// Number of snapshots in the file.
    snapshots: u64,
    /// Number of outcomes in the file.
    outcomes: u64,
    /// Number of missing messages, for topics that have any, and "unreadable" ones.
    lost: BTreeMap<&'static str, u64>,
    stop_reason: String,
}

impl Report {
    pub(crate) fn new(
        path: impl AsRef<Path>,
        closing: Closing,
        steps: RangeInclusive<u64>,
    ) -> Self {
        let counts = &closing.counts;
        Self {
            output: output::path_text(path.as_ref()),
            first_step: *steps.start(),
            last_step: *steps.end(),
            snapshots: counts[Topic::Particles].written,
            outcomes: counts[Topic::Outcomes].written,
            lost: closing.missing(),
            stop_reason: closing.stop_reason,
        }
    }

    /// Returns `true` if every published message is in the file.
    pub(crate) fn is_complete(&self) -> bool {
        self.lost.is_empty()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { first_step, last_step, snapshots, .. } = self;
        writeln!(f, "written     {}", self.output)?;
        writeln!(f, "steps       {first_step}..={last_step}, {snapshots} recorded")?;
        writeln!(f, "outcomes    {}", self.outcomes)?;
        if self.lost.is_empty() {
            writeln!(f, "lost        none")?;
        }
        for (topic, count) in &self.lost {
            writeln!(f, "lost        {topic} {count}")?;
        }
        write!(f, "stopped     {}", self.stop_reason)
    }
}
