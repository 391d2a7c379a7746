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
    /// Takes in what arrived in a round.
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
