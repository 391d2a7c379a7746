//! The marks of a timeline. Marks that are close together are merged, which limits their number.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::limits::MARKS_MAX;
use crate::message::{Mark, MarkKind};

/// Kinds of marks.
const KINDS: [MarkKind; 4] = [MarkKind::Tear, MarkKind::Pin, MarkKind::Command, MarkKind::Late];
/// Marks of one kind: as many as a wide screen has pixels.
const PER_KIND_MAX: u64 = (MARKS_MAX / KINDS.len()) as u64;

/// The marks of a recording.
#[derive(Debug, Clone)]
pub(super) struct Marks {
    first_step: u64,
    last_step: u64,
    merged: BTreeMap<Place, Mark>,
}

/// A section of the timeline, and a kind by its index in [`KINDS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    section: u64,
    kind_index: usize,
}

impl Marks {
    /// Creates the marks of a timeline between these steps.
    pub(super) fn new(first_step: u64, last_step: u64) -> Self {
        Self { first_step, last_step, merged: BTreeMap::new() }
    }

    /// Adds a mark. Events after the last step count as being at it.
    pub(super) fn add(&mut self, mark: Mark) {
        let step = mark.step.clamp(self.first_step, self.last_step);
        let mark = Mark { step, ..mark };
        let steps = u128::from(self.last_step - self.first_step) + 1;
        let section = if steps <= u128::from(PER_KIND_MAX) {
            step - self.first_step
        } else {
            let section = u128::from(step - self.first_step) * u128::from(PER_KIND_MAX) / steps;
            u64::try_from(section).unwrap_or(PER_KIND_MAX - 1)
        };
        #[allow(clippy::expect_used, reason = "a miss is a fault of the list of kinds")]
        let kind_index =
            KINDS.iter().position(|one| *one == mark.kind).expect("every kind is in the list");
        match self.merged.entry(Place { section, kind_index }) {
            Entry::Vacant(place) => drop(place.insert(mark)),
            Entry::Occupied(mut merged) => merged.get_mut().merge(mark),
        }
    }

    /// All marks, ascending by step.
    pub(super) fn list(&self) -> Vec<Mark> {
        let mut marks: Vec<_> = self.merged.values().cloned().collect();
        marks.sort_by_key(|mark| mark.step);
        marks
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::{Action, Text};

    use super::*;

    #[test]
    fn marks_are_counted_by_step_and_kind() {
        let mut marks = Marks::new(10, 500);
        marks.add(Mark::new(MarkKind::Late, 20, 1));
        marks.add(Mark::new(MarkKind::Tear, 12, 3));
        marks.add(Mark::new(MarkKind::Tear, 12, 2));
        marks.add(Mark::new(MarkKind::Command, 501, 1));
        let list: Vec<_> =
            marks.list().iter().map(|mark| (mark.kind, mark.step, mark.count)).collect();
        let expected =
            [(MarkKind::Tear, 12, 5), (MarkKind::Late, 20, 1), (MarkKind::Command, 500, 1)];
        assert_eq!(list, expected);
    }

    #[test]
    fn the_list_stays_short_and_ascending_and_counts_every_event() {
        let mut marks = Marks::new(5, 1_000_000);
        for step in (0..142_857).rev().map(|place| 5 + 7 * place) {
            for kind in KINDS {
                marks.add(Mark::new(kind, step, 1));
            }
        }
        let list = marks.list();
        assert!(list.len() <= MARKS_MAX && list.is_sorted_by_key(|mark| mark.step));
        let count: u32 = list.iter().map(|mark| mark.count).sum();
        assert_eq!(count as usize, 4 * 142_857);
        assert_eq!(list[0].step, 5);
    }

    #[test]
    fn a_mark_names_each_of_its_commands_once() {
        let mut marks = Marks::new(0, 9);
        let mark = |text| Action::Mark { text: Text::cut(text) };
        let (cut, set) = (Action::Cut { constraint: 3 }, Action::Reset);
        for action in [cut, set, cut, mark("slips"), mark("holds"), mark("slips")] {
            marks.add(Mark::from_action(&action, 5));
        }
        marks.add(Mark::from_action(&Action::Pin { particle: 1 }, 5));
        let commands: Vec<_> = marks.list().into_iter().map(|mark| mark.commands).collect();
        let others = ["cut", "reset", "mark: slips", "mark: holds"];
        assert_eq!(commands, [["pin"].to_vec(), others.to_vec()]);
    }

    #[test]
    fn the_largest_step_has_a_place() {
        let mut marks = Marks::new(0, u64::MAX);
        marks.add(Mark::new(MarkKind::Pin, u64::MAX, 1));
        assert_eq!(marks.list()[0].step, u64::MAX);
    }
}
