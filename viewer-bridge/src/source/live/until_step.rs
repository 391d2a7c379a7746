//! Messages that arrived before their state.

use std::collections::VecDeque;

/// Messages of steps that are not on show yet. An owner publishes them before the snapshot of their
/// step, so a reader may see them first.
#[derive(Debug)]
pub(super) struct UntilStep<T> {
    /// By step, in the order of arrival.
    items: VecDeque<(u64, T)>,
}

/// Messages that wait: more than arrive while one snapshot is read.
const WAITING_MAX: usize = 16;

impl<T> Default for UntilStep<T> {
    fn default() -> Self {
        Self { items: VecDeque::new() }
    }
}

impl<T> UntilStep<T> {
    /// Adds a message. If too many wait, it replaces the newest: the older ones are shown next.
    pub(super) fn add(&mut self, step: u64, item: T) {
        self.items.truncate(WAITING_MAX - 1);
        self.items.push_back((step, item));
    }

    /// Removes and returns the newest message up to a step. Drops the ones before it.
    pub(super) fn take_until(&mut self, step: u64) -> Option<(u64, T)> {
        let place = self.items.iter().rposition(|(message_step, _)| *message_step <= step)?;
        self.items.drain(..=place).next_back()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_waits_for_its_step() {
        let mut waiting = UntilStep::default();
        waiting.add(3, 'a');
        waiting.add(4, 'b');
        waiting.add(6, 'c');
        assert_eq!(waiting.take_until(2), None);
        assert_eq!(waiting.take_until(5), Some((4, 'b')));
        assert_eq!(waiting.take_until(5), None);
        assert_eq!(waiting.take_until(6), Some((6, 'c')));
    }

    #[test]
    fn if_too_many_messages_wait_the_first_and_the_last_stay() {
        let mut waiting = UntilStep::default();
        for step in 0..1000 {
            waiting.add(step, step);
        }
        assert_eq!(waiting.take_until(10), Some((10, 10)));
        assert_eq!(waiting.take_until(1000), Some((999, 999)));
    }
}
