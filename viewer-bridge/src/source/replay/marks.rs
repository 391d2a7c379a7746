//! The marks of a timeline: those close together are added up, so that there is a limit to them.

use std::collections::BTreeMap;

use crate::limits::MARKS_MAX;
use crate::message::{Mark, MarkKind};

/// Kinds of marks.
const KINDS: [MarkKind; 4] = [MarkKind::Tear, MarkKind::Pin, MarkKind::Command, MarkKind::Late];
/// Most marks of a kind: more than a screen has pixels for.
const PER_KIND_MAX: u64 = (MARKS_MAX / KINDS.len()) as u64;

/// The marks of a recording.
#[derive(Debug, Clone)]
pub(super) struct Marks {
    first_step: u64,
    last_step: u64,
    /// By stretch of the timeline and kind: the first step, and how many.
    found: BTreeMap<(u64, usize), (u64, u32)>,
}

impl Marks {
    /// Between these steps.
    pub(super) fn new(first_step: u64, last_step: u64) -> Self {
        Self { first_step, last_step, found: BTreeMap::new() }
    }

    /// Adds some of a step. Those of steps behind the end are shown at the end.
    pub(super) fn add(&mut self, kind: MarkKind, step: u64, count: u32) {
        let step = step.clamp(self.first_step, self.last_step);
        let steps = u128::from(self.last_step - self.first_step) + 1;
        let stretch = if steps <= u128::from(PER_KIND_MAX) {
            step - self.first_step
        } else {
            let stretch = u128::from(step - self.first_step) * u128::from(PER_KIND_MAX) / steps;
            u64::try_from(stretch).unwrap_or(PER_KIND_MAX - 1)
        };
        let place = KINDS.iter().position(|one| *one == kind).unwrap_or_default();
        let (first, sum) = self.found.entry((stretch, place)).or_insert((step, 0));
        *first = step.min(*first);
        *sum = sum.saturating_add(count);
    }

    /// All of them, ascending by step.
    pub(super) fn list(&self) -> Vec<Mark> {
        let marks = self.found.iter();
        let mut marks: Vec<_> = marks
            .map(|((_, place), (step, count))| Mark {
                kind: KINDS[*place],
                step: *step,
                count: *count,
            })
            .collect();
        marks.sort_by_key(|mark| mark.step);
        marks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_counted_by_step_and_kind() {
        let mut marks = Marks::new(10, 500);
        marks.add(MarkKind::Late, 20, 1);
        marks.add(MarkKind::Tear, 12, 3);
        marks.add(MarkKind::Tear, 12, 2);
        marks.add(MarkKind::Command, 501, 1);
        let list: Vec<_> =
            marks.list().iter().map(|mark| (mark.kind, mark.step, mark.count)).collect();
        let expected =
            [(MarkKind::Tear, 12, 5), (MarkKind::Late, 20, 1), (MarkKind::Command, 500, 1)];
        assert_eq!(list, expected);
    }

    #[test]
    fn however_many_there_are_the_list_is_short_ascending_and_counts_all() {
        let mut marks = Marks::new(5, 1_000_000);
        for step in (0..142_857).rev().map(|place| 5 + 7 * place) {
            for kind in KINDS {
                marks.add(kind, step, 1);
            }
        }
        let list = marks.list();
        assert!(list.len() <= MARKS_MAX && list.is_sorted_by_key(|mark| mark.step));
        let count: u32 = list.iter().map(|mark| mark.count).sum();
        assert_eq!(count as usize, 4 * 142_857);
        assert_eq!(list[0].step, 5);
    }

    #[test]
    fn steps_up_to_the_greatest_number_have_a_place() {
        let mut marks = Marks::new(0, u64::MAX);
        marks.add(MarkKind::Pin, u64::MAX, 1);
        assert_eq!(marks.list()[0].step, u64::MAX);
    }
}
