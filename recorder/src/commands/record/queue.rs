//! The bounded queue between the thread that reads shared memory and the one that writes the file.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use recorder::{AllCounts, Message, StepRow, Topic};
use sim_contract::ParticleState;

/// What is to be written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Content {
    /// Anything but a snapshot.
    Update(Message),
    /// A snapshot; its two messages stay together.
    Snapshot(StepRow, Vec<ParticleState>),
}

/// What is to be written, and when it was received: wall clock, in nanoseconds since 1970.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Item {
    pub(crate) content: Content,
    pub(crate) log_time_ns: u64,
}

/// A queue that never makes its reader wait: what does not fit is dropped and counted.
///
/// Above the limit no snapshot is accepted; the rest, which is small and which every later step
/// builds on, is accepted up to twice the limit. The load, without which a file is useless, and
/// whatever finds the queue empty are always accepted.
#[derive(Debug)]
pub(crate) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
    limit_bytes: usize,
}

#[derive(Debug, Default)]
struct State {
    items: VecDeque<Item>,
    size_bytes: usize,
    lost: AllCounts,
    is_closed: bool,
}

/// What the writing thread gets.
#[derive(Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "moved once; a box for each item would cost more")]
pub(crate) enum Popped {
    Item(Item),
    /// Nothing came in the time given.
    Nothing,
    /// Nothing will come any more.
    Closed,
}

impl Queue {
    pub(crate) fn new(limit_bytes: usize) -> Self {
        Self { state: Mutex::default(), changed: Condvar::new(), limit_bytes }
    }

    /// Takes an item, or counts it as lost.
    pub(crate) fn push(&self, item: Item) {
        let size_bytes = item.content.size_bytes();
        let mut state = self.lock();
        let (limit_bytes, topics) = match &item.content {
            Content::Update(message) => (2 * self.limit_bytes, &[message.topic()][..]),
            Content::Snapshot(..) => (self.limit_bytes, &[Topic::Steps, Topic::Particles][..]),
        };
        let is_load = [Topic::Topology, Topic::Surface].contains(&topics[0]);
        let fits = state.size_bytes + size_bytes <= limit_bytes;
        if state.is_closed || !(fits || is_load || state.items.is_empty()) {
            for topic in topics {
                state.lost[*topic].lost += 1;
            }
            return;
        }
        state.size_bytes += size_bytes;
        state.items.push_back(item);
        drop(state);
        self.changed.notify_one();
    }

    /// Ends the queue: what is in it can still be accepted.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_one();
    }

    /// Whether [`Queue::close`] was called, by either side.
    pub(crate) fn is_closed(&self) -> bool {
        self.lock().is_closed
    }

    /// The next item; waits at most `timeout` for one.
    pub(crate) fn pop(&self, timeout: Duration) -> Popped {
        let is_idle = |state: &mut State| state.items.is_empty() && !state.is_closed;
        let waited = self.changed.wait_timeout_while(self.lock(), timeout, is_idle);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.items.pop_front() {
            Some(item) => {
                state.size_bytes -= item.content.size_bytes();
                Popped::Item(item)
            }
            None if state.is_closed => Popped::Closed,
            None => Popped::Nothing,
        }
    }

    /// What was dropped so far; nothing else is counted in it.
    pub(crate) fn lost(&self) -> AllCounts {
        self.lock().lost
    }

    /// A thread that panicked leaves the queue as whole as it was.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Content {
    fn size_bytes(&self) -> usize {
        match self {
            Self::Update(message) => message.size_bytes(),
            Self::Snapshot(_, particles) => size_of::<Item>() + size_of_val(particles.as_slice()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(step: u64) -> StepRow {
        StepRow { step, scene_step: step, ..StepRow::default() }
    }

    fn snapshot(step: u64) -> Item {
        let particles = vec![ParticleState::default(); 1000];
        Item { content: Content::Snapshot(row(step), particles), log_time_ns: step }
    }

    fn keyframe(step: u64, size_bytes: usize) -> Item {
        let message = Message::Keyframe { step, bytes: vec![0; size_bytes] };
        Item { content: Content::Update(message), log_time_ns: step }
    }

    fn pop_steps(queue: &Queue) -> Vec<u64> {
        let next = || match queue.pop(Duration::ZERO) {
            Popped::Item(item) => Some(item.log_time_ns),
            Popped::Nothing | Popped::Closed => None,
        };
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn a_full_queue_drops_snapshots_only_and_counts_them() {
        let queue = Queue::new(100_000);
        for step in 0..10 {
            queue.push(keyframe(100 + step, 100));
            queue.push(snapshot(step));
        }
        let lost = queue.lost();
        assert_eq!(lost[Topic::Particles].lost, 7);
        assert_eq!(lost[Topic::Steps].lost, 7);
        assert_eq!(lost[Topic::Keyframe].lost, 0);
        let steps = pop_steps(&queue);
        assert_eq!(steps, [100, 0, 101, 1, 102, 2, 103, 104, 105, 106, 107, 108, 109]);
        queue.push(snapshot(10));
        assert_eq!(pop_steps(&queue), [10], "an empty queue takes snapshots again");
    }

    #[test]
    fn a_snapshot_above_the_limit_is_taken_by_an_empty_queue() {
        let queue = Queue::new(1000);
        queue.push(snapshot(1));
        queue.push(snapshot(2));
        assert_eq!(queue.lost()[Topic::Particles].lost, 1);
        assert_eq!(pop_steps(&queue), [1]);
        queue.push(snapshot(3));
        assert_eq!(pop_steps(&queue), [3]);
    }

    #[test]
    fn even_small_messages_have_a_limit() {
        let queue = Queue::new(1000);
        for step in 0..10 {
            queue.push(keyframe(step, 500));
        }
        assert!(queue.lost()[Topic::Keyframe].lost > 0);
        assert!(pop_steps(&queue).len() < 4);
    }

    #[test]
    fn a_closed_queue_gives_what_is_in_it_and_takes_nothing() {
        let queue = Queue::new(100_000);
        queue.push(snapshot(1));
        queue.close();
        queue.push(snapshot(2));
        assert!(matches!(queue.pop(Duration::ZERO), Popped::Item(_)));
        assert_eq!(queue.pop(Duration::ZERO), Popped::Closed);
        assert_eq!(queue.lost()[Topic::Particles].lost, 1);
    }
}
