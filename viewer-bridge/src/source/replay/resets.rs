//! Finds recorded resets between two states.

/// Finds recorded resets between the states on show. The beginning of a state is the step at which its
/// scene was at its beginning; it is `None` if the header is unreadable.
#[derive(Debug, Clone, Copy)]
pub(super) struct ResetFinder {
    /// Beginning of the last state with a readable header.
    beginning: Option<u64>,
}

impl ResetFinder {
    pub(super) fn new(beginning: Option<u64>) -> Self {
        Self { beginning }
    }

    /// Returns `true` if a reset lies between the state before and this one, in either direction. A
    /// state without a readable header is skipped, so a reset beside it is found with the next state.
    pub(super) fn passes_reset(&mut self, beginning: Option<u64>) -> bool {
        let before = self.beginning;
        self.beginning = beginning.or(before);
        before.is_some() && self.beginning != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_is_found_in_either_direction() {
        let mut resets = ResetFinder::new(Some(0));
        let passes = [0, 12, 12, 0, 0].map(|beginning| resets.passes_reset(Some(beginning)));
        assert_eq!(passes, [false, true, false, true, false]);
    }

    #[test]
    fn a_state_without_a_readable_header_is_no_reset_and_hides_none() {
        let mut resets = ResetFinder::new(Some(0));
        let passes = [None, Some(0), None, Some(13), Some(13)]
            .map(|beginning| resets.passes_reset(beginning));
        assert_eq!(passes, [false, false, false, true, false]);
        assert!(!ResetFinder::new(None).passes_reset(Some(1)));
    }
}
