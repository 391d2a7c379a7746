//! The new tears in each list of the service `tears`.
//!
//! A list contains all tears since the load or the last reset, so a missed list loses nothing: its
//! tears are written with the step of the next one.

use std::collections::VecDeque;

use recorder::TearsRow;
use sim_contract::{SnapshotHeader, TearsHeader, TornConstraint};

/// Most lists that wait for a snapshot of their step or a later step. Beyond it the oldest are
/// dropped.
const PENDING_MAX: usize = 64;

/// A message of the service `tears`.
#[derive(Debug, Clone)]
pub(crate) struct TearList {
    pub(crate) header: TearsHeader,
    pub(crate) torn: Vec<TornConstraint>,
}

/// The tears of the recorded run.
#[derive(Debug, Default)]
pub(crate) struct TearLog {
    /// In the order of publication.
    lists: VecDeque<TearList>,
    /// [`TearsHeader::since_step`] of the last list in the file.
    since_step: u64,
    /// Number of its constraints.
    known_count: usize,
}

impl TearLog {
    /// Adds the lists of a batch.
    pub(crate) fn add(&mut self, lists: Vec<TearList>) {
        self.lists.extend(lists);
        self.lists.drain(..self.lists.len().saturating_sub(PENDING_MAX));
    }

    /// Returns `true` if the torn constraints at a snapshot are known. Every load publishes a list,
    /// and a subscriber receives the newest one.
    pub(crate) fn is_known_at(&self, snapshot: &SnapshotHeader) -> bool {
        self.list_at(snapshot).is_some()
    }

    /// Starts at a snapshot. Returns the constraints that were torn before it. The tears of its own
    /// step become a row.
    pub(crate) fn begin(&mut self, first: &SnapshotHeader) -> Vec<u32> {
        let torn_count = first.torn_count as usize;
        let mut before = Vec::new();
        if let Some(list) = self.list_at(first) {
            let is_of_first = list.header.step == first.step && list.torn.len() == torn_count;
            let new_count = if is_of_first { list.header.new_count as usize } else { 0 };
            let before_count = torn_count.saturating_sub(new_count);
            before = list.torn[..before_count].iter().map(|torn| torn.constraint).collect();
            self.since_step = list.header.since_step;
        }
        let is_needed =
            |list: &TearList| list.header.step >= first.step && list.header.run_id == first.run_id;
        self.lists.retain(is_needed);
        self.known_count = before.len();
        before
    }

    /// Returns the list in force at a snapshot, or a later one that continues it.
    fn list_at(&self, snapshot: &SnapshotHeader) -> Option<&TearList> {
        let is_complete = |list: &&TearList| {
            list.header.run_id == snapshot.run_id && list.torn.len() >= snapshot.torn_count as usize
        };
        let is_later = |list: &&TearList| list.header.step > snapshot.step;
        let mut lists = self.lists.iter().filter(is_complete);
        let in_force = lists.clone().rfind(|list| !is_later(list));
        let continues = |list: &&TearList| list.header.since_step <= snapshot.step;
        in_force.or_else(|| lists.find(|list| is_later(list) && continues(list)))
    }

    /// Returns the rows of the lists up to the newest snapshot.
    pub(crate) fn rows_until(&mut self, newest: &SnapshotHeader) -> Vec<TearsRow> {
        self.lists.retain(|list| list.header.run_id == newest.run_id);
        let count = self.lists.partition_point(|list| list.header.step <= newest.step);
        let lists: Vec<_> = self.lists.drain(..count).collect();
        lists.iter().filter_map(|list| self.row(list)).collect()
    }

    /// Returns the tears of a list that are not in the file yet, if there are any.
    fn row(&mut self, list: &TearList) -> Option<TearsRow> {
        if list.header.since_step != self.since_step {
            (self.since_step, self.known_count) = (list.header.since_step, 0);
        }
        let new = list.torn.get(self.known_count..).unwrap_or_default();
        self.known_count = list.torn.len();
        let cause = |torn: &TornConstraint| torn.cause().map_or("unknown", |cause| cause.name());
        (!new.is_empty()).then(|| TearsRow {
            step: list.header.step,
            constraints: new.iter().map(|torn| torn.constraint).collect(),
            causes: new.iter().map(|torn| cause(torn).to_owned()).collect(),
        })
    }

    /// Returns the number of constraints that a snapshot counts as torn and no list contains.
    pub(crate) fn missing_count(&self, newest: &SnapshotHeader) -> u64 {
        (newest.torn_count as usize).saturating_sub(self.known_count) as u64
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::TearCause;

    use super::*;

    const RUN_ID: u64 = 77;

    fn snapshot(step: u64, torn_count: u32) -> SnapshotHeader {
        SnapshotHeader { run_id: RUN_ID, step, torn_count, ..SnapshotHeader::default() }
    }

    /// A list in which even constraints were cut and odd ones stretched.
    fn list(step: u64, since_step: u64, torn: &[u32]) -> TearList {
        let cause =
            |one: u32| if one.is_multiple_of(2) { TearCause::Cut } else { TearCause::Stretch };
        let header = TearsHeader { run_id: RUN_ID, step, since_step, new_count: 1, count: 0 };
        let torn = torn.iter().map(|one| TornConstraint::new(*one, Some(cause(*one)))).collect();
        TearList { header, torn }
    }

    /// Returns rows as text, such as "5: 2 cut, 3 stretch".
    fn rows(log: &mut TearLog, step: u64) -> Vec<String> {
        let text = |row: TearsRow| {
            let tears = row.constraints.iter().zip(&row.causes);
            let tears = tears.map(|(constraint, cause)| format!("{constraint} {cause}"));
            format!("{}: {}", row.step, tears.collect::<Vec<_>>().join(", "))
        };
        log.rows_until(&snapshot(step, 0)).into_iter().map(text).collect()
    }

    /// A log that started at step 4 without torn constraints.
    fn started() -> TearLog {
        let mut log = TearLog::default();
        log.add(vec![list(0, 0, &[])]);
        assert!(log.is_known_at(&snapshot(4, 0)));
        assert!(log.begin(&snapshot(4, 0)).is_empty());
        log
    }

    #[test]
    fn each_row_has_the_new_tears_of_its_list() {
        let mut log = started();
        log.add(vec![list(5, 0, &[2]), list(7, 0, &[2, 3, 8])]);
        assert_eq!(rows(&mut log, 7), ["5: 2 cut", "7: 3 stretch, 8 cut"]);
        assert!(rows(&mut log, 9).is_empty());
        assert_eq!(log.missing_count(&snapshot(9, 3)), 0);
    }

    #[test]
    fn a_list_waits_for_the_snapshot_of_its_step() {
        let mut log = started();
        log.add(vec![list(6, 0, &[2])]);
        assert!(rows(&mut log, 5).is_empty());
        assert_eq!(rows(&mut log, 6), ["6: 2 cut"]);
    }

    #[test]
    fn the_tears_of_a_missed_list_come_with_the_next_one_or_are_counted() {
        let mut log = started();
        log.add(vec![list(9, 0, &[2, 5, 8])]);
        assert_eq!(rows(&mut log, 9), ["9: 2 cut, 5 stretch, 8 cut"]);
        let mut log = started();
        assert_eq!(log.missing_count(&snapshot(9, 3)), 3);
        let torn: Vec<u32> = (0..200).collect();
        for count in 1..=torn.len() {
            log.add(vec![list(9 + count as u64, 0, &torn[..count])]);
        }
        let all = log.rows_until(&snapshot(1000, 200));
        let constraints: Vec<u32> = all.into_iter().flat_map(|row| row.constraints).collect();
        assert_eq!(constraints, torn, "also beyond the limit of lists");
    }

    #[test]
    fn a_list_after_a_reset_starts_again_even_with_the_same_tears() {
        let mut log = started();
        log.add(vec![list(5, 0, &[2, 3])]);
        assert_eq!(rows(&mut log, 5).len(), 1);
        // The empty list of the reset was missed.
        log.add(vec![list(11, 8, &[2, 3, 4])]);
        assert_eq!(rows(&mut log, 11), ["11: 2 cut, 3 stretch, 4 cut"]);
        log.add(vec![list(12, 12, &[6])]);
        assert_eq!(rows(&mut log, 12), ["12: 6 cut"], "cut at the boundary of the reset");
    }

    #[test]
    fn a_recording_starts_with_the_constraints_torn_before_its_first_snapshot() {
        let mut log = TearLog::default();
        log.add(vec![list(3, 0, &[9, 1])]);
        assert!(!log.is_known_at(&snapshot(6, 3)), "a newer list will follow");
        assert_eq!(log.begin(&snapshot(6, 2)), [9, 1]);
        assert!(rows(&mut log, 6).is_empty());

        let mut log = TearLog::default();
        log.add(vec![list(3, 0, &[9, 1]), list(6, 0, &[9, 1, 4])]);
        assert_eq!(log.begin(&snapshot(6, 3)), [9, 1]);
        assert_eq!(rows(&mut log, 6), ["6: 4 cut"], "the tears of the first step are a row");

        let mut log = TearLog::default();
        log.add(vec![list(8, 0, &[9, 1, 4, 5])]);
        assert_eq!(log.begin(&snapshot(6, 3)), [9, 1, 4], "the list in force was missed");
        assert_eq!(rows(&mut log, 8), ["8: 5 stretch"]);

        let mut log = TearLog::default();
        log.add(vec![list(8, 7, &[9, 1, 4, 5])]);
        assert!(!log.is_known_at(&snapshot(6, 3)), "a list after a later reset");
    }

    #[test]
    fn lists_of_another_run_are_ignored() {
        let mut log = started();
        let mut other = list(5, 0, &[3]);
        other.header.run_id = RUN_ID + 1;
        log.add(vec![other, list(6, 0, &[2])]);
        assert_eq!(rows(&mut log, 6), ["6: 2 cut"]);
    }
}
