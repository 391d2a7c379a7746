//! Messages that are missing between the recorded ones, counted by their numbers.

use std::collections::BTreeMap;

use crate::log::message::Message;
use crate::log::rows::StepRow;
use crate::log::run::Closing;
use crate::log::run::selection::ContentSelection;
use crate::log::topic::{AllCounts, Topic};

/// Counts the snapshots and outcomes that are missing in a recording, from the messages in it.
///
/// The end of a file states all losses. A recorder that is killed writes no end, but its file shows
/// the losses up to its last message: each snapshot and each outcome has a number, and none is left
/// out.
#[derive(Debug, Default)]
pub struct GapCounter {
    selection: ContentSelection,
    last_snapshot: Option<u32>,
    /// `None` before the first snapshot, which contains all earlier outcomes.
    next_outcome: Option<u64>,
    /// Outcomes that the newest snapshot contains.
    outcome_count: u64,
    counts: AllCounts,
}

impl GapCounter {
    /// Counts only what a recording with this selection should have.
    pub fn for_selection(selection: ContentSelection) -> Self {
        Self { selection, ..Self::default() }
    }

    /// Processes the next message of the file.
    pub fn add(&mut self, message: &Message) {
        match message {
            Message::Step(row) => self.add_row(row),
            Message::Outcome(row) => {
                let Some(next) = &mut self.next_outcome else { return };
                self.counts[Topic::Outcomes].gaps += row.index.saturating_sub(*next);
                *next = row.index.saturating_add(1).max(*next);
            }
            _ => {}
        }
    }

    /// Processes the header of the next snapshot.
    pub fn add_row(&mut self, row: &StepRow) {
        self.next_outcome.get_or_insert(row.outcome_count);
        self.outcome_count = row.outcome_count;
        self.add_snapshot(row.snapshot_index);
    }

    /// Adds the numbers that are left out before a snapshot. Numbers count modulo 2^32. One that goes back is that of
    /// a snapshot that the file has twice.
    fn add_snapshot(&mut self, index: u32) {
        if self.last_snapshot.is_some_and(|last| index.wrapping_sub(last).cast_signed() <= 0) {
            return;
        }
        let last = self.last_snapshot.replace(index);
        let missing = last.map_or(0, |last| self.selection.missing_between(last, index));
        for topic in [Topic::Steps, Topic::Particles] {
            self.counts[topic].gaps += missing;
        }
    }

    /// Returns the number of messages that should be in the file and are not, by topic: those that its end states, or
    /// more if the file shows more.
    pub fn lost(&self, closing: Option<&Closing>) -> BTreeMap<&'static str, u64> {
        let mut lost = closing.map(Closing::missing).unwrap_or_default();
        for (topic, shown) in self.counts().iter().filter(|(_, shown)| shown.gaps > 0) {
            let count = lost.entry(topic.name()).or_default();
            *count = shown.gaps.max(*count);
        }
        lost
    }

    /// Returns the numbers of missing messages so far, as `gaps`. The other counts are 0.
    pub fn counts(&self) -> AllCounts {
        let mut counts = self.counts;
        let next = self.next_outcome.unwrap_or(self.outcome_count);
        counts[Topic::Outcomes].gaps += self.outcome_count.saturating_sub(next);
        counts
    }
}

#[cfg(test)]
mod tests {
    use sim_messages::{Action, Command, Outcome};

    use super::*;
    use crate::log::rows::OutcomeRow;

    fn snapshot(index: u32, outcome_count: u64) -> Message {
        Message::Step(StepRow { outcome_count, snapshot_index: index, ..StepRow::default() })
    }

    fn outcome(index: u64) -> Message {
        let outcome = Outcome::new(index, 1, Command::new(1, index, Action::Reset), Ok(()));
        Message::Outcome(OutcomeRow::from(&outcome))
    }

    /// Numbers of missing snapshots and outcomes.
    #[derive(Debug, PartialEq)]
    struct Missing {
        snapshots: u64,
        outcomes: u64,
    }

    fn missing(messages: &[Message]) -> Missing {
        let mut counter = GapCounter::default();
        for message in messages {
            counter.add(message);
        }
        let counts = counter.counts();
        assert_eq!(counts[Topic::Steps], counts[Topic::Particles]);
        Missing { snapshots: counts[Topic::Steps].gaps, outcomes: counts[Topic::Outcomes].gaps }
    }

    #[test]
    fn numbers_that_are_left_out_are_missing_and_those_before_the_first_snapshot_are_not() {
        let complete = [snapshot(7, 3), outcome(3), snapshot(8, 4), snapshot(9, 4)];
        assert_eq!(missing(&complete), Missing { snapshots: 0, outcomes: 0 });
        let lossy = [snapshot(7, 3), outcome(5), snapshot(12, 9), snapshot(14, 9)];
        assert_eq!(missing(&lossy), Missing { snapshots: 5, outcomes: 5 });
    }

    #[test]
    fn the_number_of_a_snapshot_wraps() {
        let messages = [snapshot(u32::MAX, 0), snapshot(0, 0), snapshot(2, 0)];
        assert_eq!(missing(&messages).snapshots, 1);
    }

    #[test]
    fn a_snapshot_that_the_file_has_twice_adds_no_gap() {
        let messages = [0, 1, 2, 1, 2, 3, 5].map(|index| snapshot(index, 0));
        assert_eq!(missing(&messages).snapshots, 1);
    }
}
