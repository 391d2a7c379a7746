//! The lists of the recorded run: tears, colliders and parameters.

use std::mem::take;

use recorder::{AllCounts, CollidersRow, Message, ParametersRow, Topic};
use sim_contract::SnapshotHeader;

use super::batch::Batch;
use super::latched_log::LatchedLog;
use super::tear_log::TearLog;

/// The latched lists of the run.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    pub(crate) tears: TearLog,
    pub(crate) colliders: LatchedLog<CollidersRow>,
    pub(crate) parameters: LatchedLog<ParametersRow>,
}

impl Lists {
    /// Moves the lists out of a batch.
    pub(crate) fn add(&mut self, batch: &mut Batch) {
        self.tears.add(take(&mut batch.tears));
        for one in batch.colliders.drain(..) {
            self.colliders.add(one.run_id, one.step, one.row);
        }
        for one in batch.parameters.drain(..) {
            self.parameters.add(one.run_id, one.step, one.row);
        }
    }

    /// Starts at a snapshot. Returns the constraints that were torn before it.
    pub(crate) fn begin(&mut self, first: &SnapshotHeader) -> Vec<u32> {
        self.colliders.begin(first);
        self.parameters.begin(first);
        self.tears.begin(first)
    }

    /// Returns `true` if the lists at a snapshot are known.
    pub(crate) fn are_known_at(&self, snapshot: &SnapshotHeader) -> bool {
        self.tears.is_known_at(snapshot)
            && self.colliders.is_known_in(snapshot.run_id)
            && self.parameters.is_known_in(snapshot.run_id)
    }

    /// Returns the rows up to the newest snapshot.
    pub(crate) fn rows_until(&mut self, newest: &SnapshotHeader) -> Vec<Message> {
        let colliders = self.colliders.rows_until(newest).into_iter();
        // A scene without colliders has no rows.
        let colliders = colliders.filter(|row| !row.colliders.is_empty()).map(Message::Colliders);
        let tears = self.tears.rows_until(newest).into_iter().map(Message::Tears);
        let parameters = self.parameters.rows_until(newest).into_iter().map(Message::Parameters);
        colliders.chain(tears).chain(parameters).collect()
    }

    /// Sets the gaps of the lists.
    pub(crate) fn add_gaps(&self, newest: &SnapshotHeader, counts: &mut AllCounts) {
        counts[Topic::Tears].gaps = self.tears.missing_count(newest);
        counts[Topic::Colliders].gaps = self.colliders.lost_count();
        counts[Topic::Parameters].gaps = self.parameters.lost_count();
    }
}
