//! Finds recorded resets between two states.

use recorder::StepRow;

/// Finds recorded resets between the states on show.
#[derive(Debug, Clone, Copy)]
pub(super) struct ResetFinder {
    /// Of the last state with a readable header: the step at which its scene was at its beginning.
    beginning: Option<u64>,
}

impl ResetFinder {
    pub(super) fn new(first: &StepRow) -> Self {
        Self { beginning: beginning(first) }
    }

    /// Returns whether a reset lies between the state before and this one, in either direction. A state
    /// without a readable header is skipped, so a reset beside it is found with the next state.
    pub(super) fn passes_reset(&mut self, row: &StepRow) -> bool {
        let Some(beginning) = beginning(row) else { return false };
        self.beginning.replace(beginning).is_some_and(|before| before != beginning)
    }
}

/// Returns the step at which the scene of a state was at its beginning, or `None` if the header is
/// unreadable. Every field of such a header except the step is 0, even the hash.
fn beginning(row: &StepRow) -> Option<u64> {
    let unreadable = StepRow { step: row.step, ..StepRow::default() };
    (*row != unreadable).then(|| row.step.wrapping_sub(row.scene_step))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(step: u64, scene_step: u64) -> StepRow {
        StepRow { step, scene_step, state_hash: 7, ..StepRow::default() }
    }

    #[test]
    fn a_reset_is_found_in_either_direction() {
        let mut resets = ResetFinder::new(&row(10, 10));
        let passes = [row(11, 11), row(12, 0), row(13, 1), row(11, 11), row(9, 9)]
            .map(|row| resets.passes_reset(&row));
        assert_eq!(passes, [false, true, false, true, false]);
    }

    #[test]
    fn a_state_without_a_readable_header_is_no_reset_and_hides_none() {
        let unreadable = |step| StepRow { step, ..StepRow::default() };
        let mut resets = ResetFinder::new(&row(10, 10));
        let passes = [unreadable(11), row(12, 12), unreadable(13), row(14, 1), row(15, 2)]
            .map(|row| resets.passes_reset(&row));
        assert_eq!(passes, [false, false, false, true, false]);
        let mut resets = ResetFinder::new(&unreadable(0));
        assert!(!resets.passes_reset(&row(1, 1)));
    }
}
