//! The files of a run: names for new ones, and the newest finished recordings.

use std::collections::VecDeque;
use std::fs;

use crate::faults::recording::Recording;

/// Number of finished recordings that stay for later actions.
const KEPT: usize = 3;

/// Names, and the recordings that later actions may read.
#[derive(Debug, Default)]
pub(super) struct KeptFiles {
    name_count: u32,
    recordings: VecDeque<String>,
    /// Number of checked recordings.
    pub(super) checked_count: u32,
    /// Number of those that lack snapshots.
    pub(super) lossy_count: u32,
    /// Number of those without an end.
    pub(super) unfinished_count: u32,
    /// Number of snapshots in them.
    pub(super) snapshot_count: u64,
}

impl KeptFiles {
    pub(super) fn next_name(&mut self) -> String {
        self.name_count += 1;
        format!("{}.mcap", self.name_count)
    }

    /// Returns the path of the newest finished recording.
    pub(super) fn newest(&self) -> Option<String> {
        self.recordings.back().cloned()
    }

    /// Adds a recording that has passed its checks. Removes the oldest one.
    pub(super) fn add(&mut self, recording: Recording) {
        self.checked_count += 1;
        self.lossy_count += u32::from(recording.has_losses());
        self.unfinished_count += u32::from(!recording.is_finished());
        self.snapshot_count += recording.rows.len() as u64;
        let removed = if recording.is_finished() {
            self.recordings.push_back(recording.path);
            if self.recordings.len() > KEPT { self.recordings.pop_front() } else { None }
        } else {
            Some(recording.path)
        };
        if let Some(path) = removed {
            fs::remove_file(path).expect("a file of this run");
        }
    }
}
