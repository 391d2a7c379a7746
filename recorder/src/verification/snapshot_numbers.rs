//! The numbers of the snapshots, which show the missing ones.

use std::collections::BTreeMap;

use crate::log::{Closing, ContentSelection, StepRow, Topic};

/// Checks `snapshot_index` from row to row, and counts the numbers that are left out.
#[derive(Debug)]
pub(super) struct SnapshotNumbers {
    /// A simulation writes every step, so it numbers them alike.
    is_simulated: bool,
    /// Rows of older formats have no numbers.
    has_numbers: bool,
    last: Option<StepRow>,
    /// Number of the snapshots that are left out before the newest one.
    missing_before: u64,
    missing_count: u64,
    selection: ContentSelection,
}

impl SnapshotNumbers {
    pub(super) fn new(is_simulated: bool, has_numbers: bool, selection: ContentSelection) -> Self {
        let (last, missing_before, missing_count) = (None, 0, 0);
        Self { is_simulated, has_numbers, last, missing_before, missing_count, selection }
    }

    /// Checks the next row. Returns a description of a wrong number.
    pub(super) fn check(&mut self, row: &StepRow) -> Option<String> {
        let last = self.last.replace(*row);
        self.missing_before = 0;
        if !self.has_numbers {
            // Without numbers, any step that is left out may be a missing snapshot.
            let steps = last.map_or(1, |last| row.step.saturating_sub(last.step));
            self.missing_before = steps.saturating_sub(1);
            return None;
        }
        let Some(index) = row.snapshot_index else {
            return Some("its row in /steps has no snapshot_index".to_owned());
        };
        if self.is_simulated && u64::from(index) != row.step & u64::from(u32::MAX) {
            return Some(format!(
                "its snapshot_index in /steps is {index}, but not that of its step"
            ));
        }
        let last = last.filter(|last| last.step < row.step)?;
        let last_index = last.snapshot_index?;
        // Numbers count modulo 2^32. A step has at most one snapshot.
        let added = u64::from(index.wrapping_sub(last_index));
        if !(1..=row.step - last.step).contains(&added) {
            let step = last.step;
            return Some(format!(
                "its snapshot_index in /steps is {index}, but that of step {step} is {last_index}"
            ));
        }
        self.missing_before = added - 1;
        self.missing_count += self.selection.missing_between(last_index, index);
        None
    }

    /// Returns `true` if snapshots may be missing right before the newest one.
    pub(super) fn is_after_gap(&self) -> bool {
        self.missing_before > 0
    }

    /// Checks that the end of the file declares the missing snapshots. It may declare more, after
    /// the last one.
    pub(super) fn check_declared(&self, closing: &Closing) -> Option<String> {
        let missing = self.missing_count;
        let counts = [Topic::Steps, Topic::Particles].map(|topic| &closing.counts[topic]);
        let declared = counts.map(|counts| counts.lost.saturating_add(counts.gaps));
        let declared = declared.into_iter().min().filter(|declared| *declared < missing)?;
        Some(format!(
            "the metadata 'recorder' declares {declared} missing snapshots, but the numbers in \
             /steps leave out {missing}"
        ))
    }

    /// Returns the number of messages that should be in the file and are not, by topic: those that
    /// its end declares, and those that the numbers leave out.
    pub(super) fn lost(&self, closing: Option<&Closing>) -> BTreeMap<&'static str, u64> {
        let mut lost = closing.map(Closing::missing).unwrap_or_default();
        if self.missing_count > 0 {
            for topic in [Topic::Steps, Topic::Particles] {
                let count = lost.entry(topic.name()).or_default();
                *count = self.missing_count.max(*count);
            }
        }
        lost
    }
}
