//! The colliders of the run that is recorded: those of its first snapshot, and every change.

use std::collections::VecDeque;

use recorder::CollidersRow;
use sim_contract::{ColliderState, CollidersHeader, SnapshotHeader};

/// Most lists that wait for a snapshot of their step or of a later one. Of more, the oldest are
/// dropped: a node that publishes every 1000th step moves its colliders in between.
const WAITING_MAX: usize = 1024;

/// What came of the colliders.
#[derive(Debug, Default)]
pub(crate) struct ColliderLog {
    /// In the order of publication.
    rows: VecDeque<(u64, CollidersRow)>,
    /// Lists that are not in the file: dropped, or of another version.
    lost: u64,
}

impl ColliderLog {
    /// Takes in what arrived in a batch.
    pub(crate) fn add(&mut self, lists: Vec<(CollidersHeader, Vec<ColliderState>)>) {
        for (header, list) in lists {
            match CollidersRow::new(header.step, &list) {
                Some(row) => self.rows.push_back((header.run_id, row)),
                None => self.lost += 1,
            }
            if self.rows.len() > WAITING_MAX {
                self.rows.pop_front();
                self.lost += 1;
            }
        }
    }

    /// Whether anything is known of a run: a load begins with a list, be it an empty one.
    pub(crate) fn is_known_in(&self, run_id: u64) -> bool {
        self.rows.iter().any(|(of, _)| *of == run_id)
    }

    /// Begins with a snapshot: of what was before it, only the newest list is kept.
    pub(crate) fn begin(&mut self, first: &SnapshotHeader) {
        self.rows.retain(|(run_id, _)| *run_id == first.run_id);
        let newest = self.rows.iter().rposition(|(_, row)| row.step <= first.step);
        self.rows.drain(..newest.unwrap_or(0));
        self.lost = 0;
    }

    /// The rows up to the newest snapshot. What a later load begins with is not among them.
    pub(crate) fn rows_until(&mut self, newest: &SnapshotHeader) -> Vec<CollidersRow> {
        self.rows.retain(|(run_id, _)| *run_id == newest.run_id);
        let count = self.rows.partition_point(|(_, row)| row.step <= newest.step);
        let rows = self.rows.drain(..count).map(|(_, row)| row);
        // A scene without colliders has no rows.
        rows.filter(|row| !row.colliders.is_empty()).collect()
    }

    /// Lists that came and are not in the file.
    pub(crate) fn lost_count(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn add(log: &mut ColliderLog, step: u64, shape: u32) {
        let header = CollidersHeader { run_id: 7, step, ..CollidersHeader::default() };
        log.add(vec![(header, vec![ColliderState { shape, ..ColliderState::default() }])]);
    }

    fn snapshot(step: u64) -> SnapshotHeader {
        SnapshotHeader { run_id: 7, step, ..SnapshotHeader::default() }
    }

    fn steps(log: &mut ColliderLog, until: u64) -> Vec<u64> {
        log.rows_until(&snapshot(until)).iter().map(|row| row.step).collect()
    }

    #[test]
    fn it_begins_with_the_newest_list_before_the_first_snapshot() {
        let mut log = ColliderLog::default();
        assert!(!log.is_known_in(7));
        for step in [0, 3, 5, 8] {
            add(&mut log, step, 0);
        }
        assert!(log.is_known_in(7) && !log.is_known_in(8));
        log.begin(&snapshot(6));
        assert_eq!(steps(&mut log, 6), [5]);
        assert_eq!(steps(&mut log, 9), [8]);
    }

    #[test]
    fn what_cannot_be_written_or_waits_too_long_is_counted() {
        let mut log = ColliderLog::default();
        log.begin(&snapshot(0));
        add(&mut log, 1, 99);
        assert_eq!((steps(&mut log, 1), log.lost_count()), (vec![], 1));
        for step in 0..WAITING_MAX as u64 + 3 {
            add(&mut log, 2 + step, 0);
        }
        assert_eq!(log.lost_count(), 4);
        assert_eq!(steps(&mut log, u64::MAX).len(), WAITING_MAX);
    }
}
