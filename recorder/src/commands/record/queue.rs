//! The bounded queue from the thread that reads shared memory to the thread that writes the file.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use recording::{AllCounts, Backlog, Closing, Message, ParticleBuffer, StepRow, Topic};
use sim_contract::Action;

use super::start::RunHeader;

/// Bytes that wake the writing thread before its time: those of some chunks. Waking it for each snapshot takes
/// longer than writing a small one, and waking it for each chunk takes a tenth of all processor time.
const WAKE_SIZE_BYTES: usize = 4 << 20;
/// The part of the limit that wakes the writing thread, if that is less.
const WAKE_PART: usize = 4;
/// Most spare buffers. A chunk of small snapshots returns more of them, whose memory is freed.
const SPARE_BUFFERS_MAX: usize = 32;
/// Spare buffers of any size: the writing thread returns one while the next snapshot arrives.
const SPARE_BUFFERS_MIN: usize = 2;
/// Most bytes of more spare buffers: more than wakes the writing thread and is in its open chunk.
const SPARE_SIZE_BYTES_MAX: usize = 2 * WAKE_SIZE_BYTES;

/// One or two messages to write.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "the largest row has the parameters: 416 bytes")]
pub(crate) enum Content {
    /// Any message except those of a snapshot.
    Update(Message),
    /// The two messages of a snapshot, which stay together.
    Snapshot(StepRow, ParticleBuffer),
}

/// Something that is worth a file of a black box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event<'a> {
    Mark { step: u64, text: &'a str },
    Tears { step: u64, count: usize },
    Frozen { step: u64 },
}

impl Event<'_> {
    pub(crate) fn step(self) -> u64 {
        match self {
            Self::Mark { step, .. } | Self::Tears { step, .. } | Self::Frozen { step } => step,
        }
    }
}

/// A content with the time of its reception: wall clock, in nanoseconds since 1970.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Item {
    pub(crate) content: Content,
    pub(crate) log_time_ns: u64,
}

/// Treatment of a file that has ended. Without a black box, each is written as its contents arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileEnd {
    /// It is written, after those before it that are kept, as one file.
    Write,
    /// It is kept, and the next one continues it.
    Keep,
    /// It is kept, and those before it whatever their age, because a file of them will be written.
    KeepAll,
    /// It is dropped, with those before it.
    Drop,
}

/// An entry of the queue: the start of a file, a content, or the end of a file.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "nearly every entry is an item")]
pub(crate) enum Entry {
    /// A file begins.
    Begin {
        header: Box<RunHeader>,
        log_time_ns: u64,
    },
    Item(Item),
    /// The file ends.
    End(Box<Closing>, FileEnd),
}

/// A queue that never blocks the reading thread: it drops and counts items that do not fit.
///
/// The limit applies to snapshots. Other messages are small, and later steps build on them, so their
/// limit is twice as high. The first snapshot of a file and everything before it, without which the file
/// is useless, and an item that finds the queue empty are always accepted, so no file may begin without
/// [`Queue::has_room`]. Beyond that, a reader must be
/// able to collect the messages between two snapshots: the queue drops those for which the [`Backlog`] has
/// no room.
#[derive(Debug)]
pub(crate) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
    limit_bytes: usize,
}

#[derive(Debug, Default)]
struct State {
    entries: VecDeque<Entry>,
    size_bytes: usize,
    /// The buffers of written snapshots.
    spare: Vec<ParticleBuffer>,
    /// The accepted messages without a snapshot; `None` before the start.
    backlog: Option<Backlog>,
    /// The newest file has no snapshot yet.
    is_beginning: bool,
    /// Messages of the newest file that were dropped.
    lost: AllCounts,
    is_closed: bool,
}

impl Queue {
    pub(crate) fn new(limit_bytes: usize) -> Self {
        Self { state: Mutex::default(), changed: Condvar::new(), limit_bytes }
    }

    /// Begins a file, with the rows of its load.
    pub(crate) fn begin(&self, mut header: RunHeader, log_time_ns: u64) {
        let rows = std::mem::take(&mut header.rows);
        let mut state = self.lock();
        state.backlog = Some(Backlog::new(&header.run, header.scene.len()));
        state.is_beginning = true;
        state.push(Entry::Begin { header: Box::new(header), log_time_ns });
        drop(state);
        for row in rows {
            self.push(Item { content: Content::Update(row), log_time_ns });
        }
    }

    /// Adds an item, or counts it as lost.
    pub(crate) fn push(&self, item: Item) {
        let size_bytes = item.content.size_bytes();
        let mut state = self.lock();
        let (limit_bytes, topics) = match &item.content {
            Content::Update(message) => (2 * self.limit_bytes, &[message.topic()][..]),
            Content::Snapshot(..) => (self.limit_bytes, &[Topic::Steps, Topic::Particles][..]),
        };
        let fits = state.size_bytes + size_bytes <= limit_bytes || state.entries.is_empty();
        let is_accepted = state.is_beginning || fits && state.can_be_read_with(&item.content);
        if state.is_closed || !is_accepted {
            for topic in topics {
                state.lost[*topic].lost += 1;
            }
            return;
        }
        state.is_beginning &= item.content.snapshot_step().is_none();
        state.add_to_backlog(&item.content);
        let was_idle = state.size_bytes < self.wake_size_bytes();
        state.push(Entry::Item(item));
        let is_due = was_idle && state.size_bytes >= self.wake_size_bytes();
        drop(state);
        if is_due {
            self.changed.notify_one();
        }
    }

    /// Ends the file, and adds the numbers of its dropped messages to its end.
    pub(crate) fn end(&self, mut closing: Closing, end: FileEnd) {
        let mut state = self.lock();
        closing.counts.set_lost(&std::mem::take(&mut state.lost));
        state.is_beginning = false;
        state.push(Entry::End(Box::new(closing), end));
    }

    /// Returns the numbers of dropped messages of the newest file.
    pub(crate) fn lost(&self) -> AllCounts {
        self.lock().lost
    }

    /// Returns `true` if another file may begin.
    pub(crate) fn has_room(&self) -> bool {
        self.lock().size_bytes < self.limit_bytes
    }

    /// Returns the size of what waits, in bytes.
    pub(crate) fn size_bytes(&self) -> usize {
        self.lock().size_bytes
    }

    /// Gives a buffer back, after its snapshot was written.
    pub(crate) fn add_spare(&self, buffer: ParticleBuffer) {
        let mut state = self.lock();
        let size_bytes = |buffer: &ParticleBuffer| size_of_val(buffer.particles());
        let spare_bytes: usize = state.spare.iter().map(size_bytes).sum();
        let count = state.spare.len();
        let has_room =
            count < SPARE_BUFFERS_MAX && spare_bytes + size_bytes(&buffer) <= SPARE_SIZE_BYTES_MAX;
        if count < SPARE_BUFFERS_MIN || has_room {
            state.spare.push(buffer);
        }
    }

    /// Returns a buffer for the next snapshot.
    pub(crate) fn take_spare(&self) -> ParticleBuffer {
        self.lock().spare.pop().unwrap_or_default()
    }

    /// Closes the queue. Items in the queue can still be popped.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_one();
    }

    /// Returns `true` if either side has called [`Queue::close`].
    pub(crate) fn is_closed(&self) -> bool {
        self.lock().is_closed
    }

    /// Waits until there is enough to write, at most `timeout`. Returns the number of entries, or `None` when
    /// the queue is closed and empty.
    pub(crate) fn wait(&self, timeout: Duration) -> Option<usize> {
        let is_idle =
            |state: &mut State| state.size_bytes < self.wake_size_bytes() && !state.is_closed;
        let waited = self.changed.wait_timeout_while(self.lock(), timeout, is_idle);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let count = state.entries.len();
        (count > 0 || !state.is_closed).then_some(count)
    }

    /// Returns the next entry, if there is one.
    pub(crate) fn pop(&self) -> Option<Entry> {
        let mut state = self.lock();
        let entry = state.entries.pop_front();
        state.size_bytes -= entry.as_ref().map_or(0, Entry::size_bytes);
        entry
    }

    fn wake_size_bytes(&self) -> usize {
        WAKE_SIZE_BYTES.min(self.limit_bytes / WAKE_PART)
    }

    /// Locks the state. A panic of the other thread cannot leave it inconsistent.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn push(&mut self, entry: Entry) {
        self.size_bytes += entry.size_bytes();
        self.entries.push_back(entry);
    }

    /// Returns `true` if the file can be read with this content.
    fn can_be_read_with(&self, content: &Content) -> bool {
        match (content, &self.backlog) {
            (Content::Update(message), Some(backlog)) => backlog.has_room_for(message),
            _ => true,
        }
    }

    fn add_to_backlog(&mut self, content: &Content) {
        let Some(backlog) = &mut self.backlog else { return };
        match content {
            Content::Update(Message::Step(_)) | Content::Snapshot(..) => backlog.clear(),
            Content::Update(message) => {
                // The start of a file always fits: the limit includes it.
                let _fits = backlog.add(message);
            }
        }
    }
}

impl Entry {
    fn size_bytes(&self) -> usize {
        match self {
            Self::Begin { header, .. } => {
                let meshes: usize = header.colliders.files.iter().map(|file| file.text.len()).sum();
                size_of::<RunHeader>() + header.scene.len() + meshes
            }
            Self::Item(item) => item.content.size_bytes(),
            Self::End(..) => size_of::<Closing>(),
        }
    }
}

impl Content {
    /// Returns the event, if the content is one.
    pub(crate) fn event(&self) -> Option<Event<'_>> {
        let Self::Update(message) = self else { return None };
        match message {
            Message::Outcome(row) if row.is_applied() => match &row.action {
                Action::Mark { text } => Some(Event::Mark { step: row.step, text: text.as_str() }),
                _ => None,
            },
            Message::Tears(row) if !row.constraints.is_empty() => {
                Some(Event::Tears { step: row.step, count: row.constraints.len() })
            }
            Message::Event(row) if row.kind == "frozen" => Some(Event::Frozen { step: row.step }),
            _ => None,
        }
    }

    /// Returns the step of a snapshot, with its particles or without.
    pub(crate) fn snapshot_step(&self) -> Option<u64> {
        match self {
            Self::Snapshot(row, _) | Self::Update(Message::Step(row)) => Some(row.step),
            Self::Update(_) => None,
        }
    }

    pub(crate) fn size_bytes(&self) -> usize {
        match self {
            Self::Update(message) => message.size_bytes(),
            Self::Snapshot(_, buffer) => size_of::<Item>() + size_of_val(buffer.particles()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::mpsc::{RecvTimeoutError, channel};
    use std::thread;

    use sim_contract::ParticleState;

    use super::*;

    /// Longest wait for another thread.
    const DEADLINE: Duration = Duration::from_secs(30);

    fn row(step: u64) -> StepRow {
        StepRow { step, scene_step: step, ..StepRow::default() }
    }

    fn snapshot(step: u64) -> Item {
        let particles = vec![ParticleState::default(); 1000].as_slice().into();
        Item { content: Content::Snapshot(row(step), particles), log_time_ns: step }
    }

    fn keyframe(step: u64, size_bytes: usize) -> Item {
        let message = Message::Keyframe { step, bytes: vec![0; size_bytes] };
        Item { content: Content::Update(message), log_time_ns: step }
    }

    fn pop_steps(queue: &Queue) -> Vec<u64> {
        let next = || match queue.pop() {
            Some(Entry::Item(item)) => Some(item.log_time_ns),
            _ => None,
        };
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn a_full_queue_drops_and_counts_snapshots_only() {
        let queue = Queue::new(100_000);
        for step in 0..10 {
            queue.push(keyframe(100 + step, 100));
            queue.push(snapshot(step));
        }
        let lost = queue.lock().lost;
        assert_eq!(lost[Topic::Particles].lost, 7);
        assert_eq!(lost[Topic::Steps].lost, 7);
        assert_eq!(lost[Topic::Keyframe].lost, 0);
        let steps = pop_steps(&queue);
        assert_eq!(steps, [100, 0, 101, 1, 102, 2, 103, 104, 105, 106, 107, 108, 109]);
        queue.push(snapshot(10));
        assert_eq!(pop_steps(&queue), [10], "an empty queue accepts snapshots again");
    }

    #[test]
    fn an_empty_queue_accepts_a_snapshot_above_the_limit() {
        let queue = Queue::new(1000);
        queue.push(snapshot(1));
        queue.push(snapshot(2));
        assert_eq!(queue.lock().lost[Topic::Particles].lost, 1);
        assert_eq!(pop_steps(&queue), [1]);
        queue.push(snapshot(3));
        assert_eq!(pop_steps(&queue), [3]);
    }

    #[test]
    fn small_messages_have_a_limit_too() {
        let queue = Queue::new(1000);
        for step in 0..10 {
            queue.push(keyframe(step, 500));
        }
        assert!(queue.lock().lost[Topic::Keyframe].lost > 0);
        assert!(pop_steps(&queue).len() < 4);
    }

    #[test]
    fn some_chunks_are_due_and_so_is_a_part_of_a_small_limit() {
        for (limit_bytes, wakes_at) in [(100 << 20, 130), (1 << 20, 9)] {
            let queue = Queue::new(limit_bytes);
            for step in 0..wakes_at {
                queue.push(snapshot(step));
                let is_due = queue.lock().size_bytes >= queue.wake_size_bytes();
                assert_eq!(is_due, step + 1 == wakes_at);
            }
            assert_eq!(queue.wait(Duration::MAX), usize::try_from(wakes_at).ok());
        }
    }

    /// In nearly every round, the thread waits before the snapshots are due.
    #[test]
    fn the_waiting_thread_wakes_for_some_snapshots_and_for_the_end() {
        let queue = Arc::new(Queue::new(1 << 20));
        let waiting = Arc::clone(&queue);
        let (woken, wakes) = channel();
        thread::spawn(move || {
            while waiting.wait(Duration::MAX).is_some() {
                while waiting.pop().is_some() {}
                woken.send(()).unwrap();
            }
        });
        for round in 0..100 {
            for step in 0..9 {
                queue.push(snapshot(step));
            }
            assert_eq!(wakes.recv_timeout(DEADLINE), Ok(()), "round {round}");
        }
        queue.close();
        assert_eq!(wakes.recv_timeout(DEADLINE), Err(RecvTimeoutError::Disconnected));
    }

    #[test]
    fn spare_buffers_are_limited_in_number_and_size() {
        for (particle_count, kept) in [(10, 32), (40_000, 6), (1_000_000, 2)] {
            let queue = Queue::new(1000);
            let particles = vec![ParticleState::default(); particle_count];
            for _ in 0..40 {
                queue.add_spare(particles.as_slice().into());
            }
            assert_eq!(queue.lock().spare.len(), kept, "{particle_count} particles");
            assert_eq!(queue.take_spare().particles().len(), particle_count);
        }
    }

    #[test]
    fn a_closed_queue_returns_its_items_and_accepts_no_more() {
        let queue = Queue::new(100_000);
        queue.push(snapshot(1));
        queue.close();
        queue.push(snapshot(2));
        assert_eq!(queue.wait(Duration::MAX), Some(1));
        assert!(matches!(queue.pop(), Some(Entry::Item(_))));
        assert_eq!((queue.pop(), queue.wait(Duration::MAX)), (None, None));
        assert_eq!(queue.lock().lost[Topic::Particles].lost, 1);
    }
}
