//! What came before the state that it belongs to.

use std::collections::VecDeque;

/// Messages of the steps that are not on show yet. An owner publishes them before the snapshot of
/// their step: a reader may meet them first, and with them what belongs to a load that is not on
/// show.
#[derive(Debug)]
pub(super) struct Waiting<T> {
    /// By step, in the order of arrival.
    items: VecDeque<(u64, T)>,
}

/// Most messages that wait: more than come while one snapshot is read.
const WAITING_MAX: usize = 16;

impl<T> Default for Waiting<T> {
    fn default() -> Self {
        Self { items: VecDeque::new() }
    }
}

impl<T> Waiting<T> {
    /// Adds a message. Where too many wait, it takes the place of the newest: the older ones are
    /// those that are about to be shown.
    pub(super) fn add(&mut self, step: u64, item: T) {
        self.items.truncate(WAITING_MAX - 1);
        self.items.push_back((step, item));
    }

    /// The newest message of that step or one before it; those that came before it are void.
    pub(super) fn take_until(&mut self, step: u64) -> Option<(u64, T)> {
        let place = self.items.iter().rposition(|(of, _)| *of <= step)?;
        self.items.drain(..=place).next_back()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_waits_for_its_step() {
        let mut waiting = Waiting::default();
        waiting.add(3, 'a');
        waiting.add(4, 'b');
        waiting.add(6, 'c');
        assert_eq!(waiting.take_until(2), None);
        assert_eq!(waiting.take_until(5), Some((4, 'b')));
        assert_eq!(waiting.take_until(5), None);
        assert_eq!(waiting.take_until(6), Some((6, 'c')));
    }

    #[test]
    fn where_too_many_wait_the_first_and_the_last_stay() {
        let mut waiting = Waiting::default();
        for step in 0..1000 {
            waiting.add(step, step);
        }
        assert_eq!(waiting.take_until(10), Some((10, 10)));
        assert_eq!(waiting.take_until(1000), Some((999, 999)));
    }
}
