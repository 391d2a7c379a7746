//! The messages of a latched service in the recorded run: the one in force at its first snapshot,
//! and every later one.

use std::collections::VecDeque;

use sim_contract::SnapshotHeader;

/// Most messages that wait for a snapshot of their step or a later step. Beyond it the oldest are
/// dropped. A node that publishes every 1000th step moves its colliders in between.
const PENDING_MAX: usize = 1024;

/// The messages of a latched service, as rows of the recording.
#[derive(Debug)]
pub(crate) struct LatchedLog<Row> {
    /// In the order of publication.
    entries: VecDeque<Entry<Row>>,
    /// Number of messages that are not in the file: dropped, or of another version.
    lost: u64,
}

#[derive(Debug)]
struct Entry<Row> {
    run_id: u64,
    step: u64,
    row: Row,
}

impl<Row> Default for LatchedLog<Row> {
    fn default() -> Self {
        Self { entries: VecDeque::new(), lost: 0 }
    }
}

impl<Row> LatchedLog<Row> {
    /// Adds a message. `row` is `None` if it has another version.
    pub(crate) fn add(&mut self, run_id: u64, step: u64, row: Option<Row>) {
        match row {
            Some(row) => self.entries.push_back(Entry { run_id, step, row }),
            None => self.lost += 1,
        }
        if self.entries.len() > PENDING_MAX {
            self.entries.pop_front();
            self.lost += 1;
        }
    }

    /// Returns `true` if any message of a run has arrived. Every load publishes one.
    pub(crate) fn is_known_in(&self, run_id: u64) -> bool {
        self.entries.iter().any(|entry| entry.run_id == run_id)
    }

    /// Starts at a snapshot. Of the messages up to it, only the newest is kept.
    pub(crate) fn begin(&mut self, first: &SnapshotHeader) {
        self.entries.retain(|entry| entry.run_id == first.run_id);
        let newest = self.entries.iter().rposition(|entry| entry.step <= first.step);
        self.entries.drain(..newest.unwrap_or(0));
        self.lost = 0;
    }

    /// Returns the rows up to the newest snapshot. Messages of a later load stay.
    pub(crate) fn rows_until(&mut self, newest: &SnapshotHeader) -> Vec<Row> {
        self.entries.retain(|entry| entry.run_id == newest.run_id);
        let count = self.entries.partition_point(|entry| entry.step <= newest.step);
        self.entries.drain(..count).map(|entry| entry.row).collect()
    }

    /// Returns the number of messages that arrived and are not in the file.
    pub(crate) fn lost_count(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(step: u64) -> SnapshotHeader {
        SnapshotHeader { run_id: 7, step, ..SnapshotHeader::default() }
    }

    #[test]
    fn the_log_starts_with_the_newest_message_before_the_first_snapshot() {
        let mut log = LatchedLog::default();
        assert!(!log.is_known_in(7));
        for step in [0, 3, 5, 8] {
            log.add(7, step, Some(step));
        }
        assert!(log.is_known_in(7) && !log.is_known_in(8));
        log.begin(&snapshot(6));
        assert_eq!(log.rows_until(&snapshot(6)), [5]);
        assert_eq!(log.rows_until(&snapshot(9)), [8]);
    }

    #[test]
    fn messages_of_another_version_or_beyond_the_limit_are_counted() {
        let mut log = LatchedLog::default();
        log.begin(&snapshot(0));
        log.add(7, 1, None);
        assert_eq!((log.rows_until(&snapshot(1)), log.lost_count()), (vec![], 1));
        for step in 0..PENDING_MAX as u64 + 3 {
            log.add(7, 2 + step, Some(step));
        }
        assert_eq!(log.lost_count(), 4);
        assert_eq!(log.rows_until(&snapshot(u64::MAX)).len(), PENDING_MAX);
    }
}
