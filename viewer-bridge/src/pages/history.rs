//! The past of the load on show: the frames that pages received, in bounded memory, one for all pages.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use recording::OutcomeRow;

use super::connection::Subscription;
use super::frames::FrameSet;
use crate::limits::{HISTORY_MARKS_MAX, HISTORY_SIZE_BYTES_MAX, HISTORY_STATES_MAX};
use crate::message::{Choice, HistoryText, Mark, MarkKind, Toward};
use crate::wire::{Format, Past, Pins, Stamp, Tear};

/// Marks of one kind that are closer than a second divided by this are merged.
const MARKS_PER_SECOND_MAX: u64 = 20;

/// The frames of a load that pages received, with everything that belongs to them.
///
/// Each frame is kept while it fits. Then every second one of the older half is removed, again and
/// again, so that the distance between frames grows with their age. The oldest one stays. The history
/// of a node thins its states in the same way.
#[derive(Debug, Default)]
pub(super) struct History {
    /// By ascending step.
    states: VecDeque<PastState>,
    size_bytes: usize,
    /// A frame was too large to be kept.
    is_too_small: bool,
    /// Everything that a frame shows besides its own messages.
    now: Around,
    torn_count: u32,
    rate_hz: u32,
    /// Ascending by step.
    marks: VecDeque<Mark>,
    /// The pages do not know the marks or the first step yet.
    is_changed: bool,
}

/// The reliable messages that belong to a frame, each with the whole list.
#[derive(Debug, Clone, Default)]
struct Around {
    tear: Option<Bytes>,
    pins: Option<Bytes>,
}

/// A frame of the past.
#[derive(Debug)]
struct PastState {
    stamp: Stamp,
    frame: Arc<FrameSet>,
    around: Around,
    size_bytes: usize,
}

/// A state of the past, as a page receives it.
#[derive(Debug)]
pub(crate) struct PastMessages {
    /// Step of the state.
    pub(crate) step: u64,
    /// PAST, and the messages that it announces.
    pub(crate) messages: Vec<Bytes>,
}

impl History {
    /// Forgets everything. Frames of another load follow.
    pub(super) fn begin_load(&mut self, rate_hz: u32) {
        *self = Self { rate_hz, is_changed: true, ..Self::default() };
    }

    /// Keeps the whole list of torn constraints for the frames to come, as TEAR. The first `known_count`
    /// of `count` were torn before.
    pub(super) fn set_torn(&mut self, step: u64, known_count: u32, count: u32, tear: Bytes) {
        self.now.tear = Some(tear);
        // A list that does not continue the one before is that of another state, after a rewind.
        if known_count == self.torn_count && count > known_count {
            self.add_mark(Mark::new(MarkKind::Tear, step, count - known_count));
        }
        self.torn_count = count;
    }

    /// Keeps the particles that are not free for the frames to come.
    pub(super) fn set_pins(&mut self, pins: Bytes) {
        self.now.pins = Some(pins);
    }

    /// Marks the step of an applied command.
    pub(super) fn add_outcome(&mut self, row: &OutcomeRow) {
        if row.is_applied() {
            self.add_mark(Mark::from_action(&row.action, row.step));
        }
    }

    fn add_mark(&mut self, mark: Mark) {
        self.is_changed = true;
        let near = u64::from(self.rate_hz) / MARKS_PER_SECOND_MAX;
        let is_near = |one: &&mut Mark| one.kind == mark.kind && mark.step <= one.step + near;
        if let Some(near) = self.marks.iter_mut().rev().take(MarkKind::COUNT).find(is_near) {
            near.merge(mark);
            return;
        }
        if self.marks.len() == HISTORY_MARKS_MAX {
            self.marks.pop_front();
        }
        let place = self.marks.partition_point(|one| one.step <= mark.step);
        self.marks.insert(place, mark);
    }

    /// Keeps a frame. A repeated one, in another format, is not kept again.
    pub(super) fn keep(&mut self, stamp: Stamp, frame: &Arc<FrameSet>) {
        if self.states.back().is_some_and(|newest| newest.stamp.step >= stamp.step) {
            return;
        }
        let around = self.now.clone();
        // What frames share counts for each of them, so that the memory is never exceeded.
        let size_bytes = frame.size_bytes() + around.size_bytes() + size_of::<PastState>();
        self.is_too_small = size_bytes > HISTORY_SIZE_BYTES_MAX;
        if self.is_too_small {
            self.is_changed |= self.states.is_empty();
            return;
        }
        while self.states.len() >= HISTORY_STATES_MAX
            || self.size_bytes + size_bytes > HISTORY_SIZE_BYTES_MAX
        {
            self.thin();
        }
        self.is_changed |= self.states.is_empty();
        self.size_bytes += size_bytes;
        self.states.push_back(PastState { stamp, frame: Arc::clone(frame), around, size_bytes });
    }

    /// Removes every second frame of the older half, but not the oldest. A single one is removed.
    fn thin(&mut self) {
        let count = self.states.len();
        let older_count = (count / 2).max(2);
        let mut index = 0;
        let size_bytes = &mut self.size_bytes;
        self.states.retain(|state| {
            let keeps = count > 1 && (index >= older_count || index % 2 == 0);
            index += 1;
            *size_bytes -= if keeps { 0 } else { state.size_bytes };
            keeps
        });
    }

    /// Finds the kept state nearest to a step on one side of it, or the last one on that side.
    pub(super) fn find(&self, step: u64, toward: Toward, page: Viewer<'_>) -> Option<PastMessages> {
        let at_or_before = self.states.partition_point(|state| state.stamp.step <= step);
        let before = self.states.partition_point(|state| state.stamp.step < step);
        let index = match toward {
            Toward::Before => at_or_before.saturating_sub(1),
            Toward::After => before.min(self.states.len().saturating_sub(1)),
        };
        self.states.get(index).map(|state| state.messages(page))
    }

    /// The message for pages, if it differs from the one before.
    pub(super) fn take_change(&mut self) -> Option<HistoryText> {
        std::mem::take(&mut self.is_changed).then(|| self.text())
    }

    fn text(&self) -> HistoryText {
        let megabytes = HISTORY_SIZE_BYTES_MAX >> 20;
        let text = match (self.states.is_empty(), self.is_too_small) {
            (true, true) => format!(
                "No past state is kept, because a picture of this scene takes more than {megabytes} MiB."
            ),
            (true, false) => "No state has been shown yet.".to_owned(),
            (false, _) => String::new(),
        };
        HistoryText {
            first_step: self.states.front().map(|state| state.stamp.step),
            marks: self.marks.iter().cloned().collect(),
            text,
        }
    }
}

/// A page that looks back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewer<'a> {
    pub(super) choice: Choice,
    pub(super) subscription: &'a Subscription,
}

impl Around {
    fn size_bytes(&self) -> usize {
        [&self.tear, &self.pins].into_iter().flatten().map(Bytes::len).sum()
    }
}

impl PastState {
    fn messages(&self, page: Viewer<'_>) -> PastMessages {
        let Self { stamp, frame, around, .. } = self;
        let nothing = || Tear { stamp: *stamp, ..Tear::default() }.encode();
        let free = || Pins { stamp: *stamp, ..Pins::default() }.encode();
        let tear = around.tear.clone().unwrap_or_else(nothing);
        let pins = around.pins.clone().unwrap_or_else(free);
        let colliders = frame.colliders.as_ref().map(|colliders| colliders.bytes.clone());
        let (wanted, other) = match frame.properties.format_for(page.choice) {
            Format::F32 => (&frame.f32, &frame.u16),
            Format::U16 => (&frame.u16, &frame.f32),
        };
        // Nobody asked for the wanted format at that time: the page reads both.
        let positions = wanted.clone().or_else(|| other.clone());
        let around = [Some(tear), Some(pins), colliders].into_iter().flatten();
        let mut messages: Vec<_> =
            around.chain(page.subscription.select(frame)).chain(positions).collect();
        messages.insert(0, Past { stamp: *stamp, count: messages.len() }.encode());
        PastMessages { step: stamp.step, messages }
    }
}

#[cfg(test)]
mod tests {
    //! Checks which frames are kept, and what a page receives of them.
    use sim_contract::TornConstraint;

    use super::*;
    use crate::wire_decoder::{Message, decode};

    static NO_SUBSCRIPTION: Subscription =
        Subscription { forces: false, speeds: false, particles: Vec::new() };
    const PAGE: Viewer<'static> = Viewer { choice: Choice::Auto, subscription: &NO_SUBSCRIPTION };

    /// A frame whose positions take `size_bytes`.
    fn frame(step: u64, size_bytes: usize) -> Arc<FrameSet> {
        let number = u32::try_from(step).unwrap();
        let f32 = Some(Bytes::from(vec![0; size_bytes]));
        Arc::new(FrameSet { number, f32, ..FrameSet::default() })
    }

    fn stamp(step: u64) -> Stamp {
        Stamp { epoch: 1, step }
    }

    fn keep(history: &mut History, steps: impl Iterator<Item = u64>, size_bytes: usize) {
        for step in steps {
            history.keep(stamp(step), &frame(step, size_bytes));
        }
    }

    fn steps(history: &History) -> Vec<u64> {
        history.states.iter().map(|state| state.stamp.step).collect()
    }

    fn found(history: &History, step: u64, toward: Toward) -> Option<u64> {
        history.find(step, toward, PAGE).map(|past| past.step)
    }

    #[test]
    fn old_frames_are_thinned_while_the_oldest_and_the_last_half_minute_stay() {
        let mut history = History::default();
        history.begin_load(240);
        // Ten minutes of a small scene, at 60 frames a second.
        keep(&mut history, (0..36_000).map(|frame| 4 * frame), 2_000);
        let kept = steps(&history);
        assert!(kept.len() <= HISTORY_STATES_MAX && kept.len() > HISTORY_STATES_MAX / 4);
        assert_eq!((kept[0], *kept.last().unwrap()), (0, 4 * 35_999));
        let last: Vec<_> = kept.iter().rev().take(1800).rev().copied().collect();
        assert_eq!(last, (34_200..36_000).map(|frame| 4 * frame).collect::<Vec<_>>());
        let gaps: Vec<_> = kept.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(gaps.is_sorted_by(|older, newer| older >= newer), "distances grow with the age");
    }

    #[test]
    fn the_memory_is_never_exceeded_however_large_the_frames_are() {
        for size_bytes in [1 << 20, 20 << 20, 40 << 20] {
            let mut history = History::default();
            keep(&mut history, 0..200, size_bytes);
            assert!(history.size_bytes <= HISTORY_SIZE_BYTES_MAX, "{size_bytes}");
            let sum: usize = history.states.iter().map(|state| state.size_bytes).sum();
            assert_eq!(history.size_bytes, sum);
            assert_eq!(steps(&history).last(), Some(&199), "{size_bytes}: the newest is kept");
        }
    }

    #[test]
    fn a_scene_that_is_too_large_says_so_and_keeps_nothing() {
        let mut history = History::default();
        history.begin_load(240);
        assert_eq!(history.take_change().unwrap().text, "No state has been shown yet.");
        keep(&mut history, 0..2, HISTORY_SIZE_BYTES_MAX);
        let text = history.take_change().unwrap();
        assert_eq!(text.first_step, None);
        assert!(text.text.contains("more than 64 MiB"), "{}", text.text);
        assert_eq!(found(&history, 1, Toward::Before), None);
    }

    #[test]
    fn a_state_is_found_on_either_side_of_a_step_and_at_both_ends() {
        let mut history = History::default();
        keep(&mut history, [10, 20, 30].into_iter(), 100);
        let before = [5, 10, 19, 20, 99].map(|step| found(&history, step, Toward::Before));
        assert_eq!(before, [10, 10, 10, 20, 30].map(Some));
        let after = [5, 10, 11, 30, 99].map(|step| found(&history, step, Toward::After));
        assert_eq!(after, [10, 10, 20, 30, 30].map(Some));
    }

    #[test]
    fn a_state_has_the_tears_and_pins_of_its_own_time() {
        let mut history = History::default();
        history.begin_load(60);
        keep(&mut history, 1..2, 100);
        let torn = vec![TornConstraint { constraint: 7, cause: 3 }];
        let tear = Tear { stamp: stamp(2), first: 0, torn };
        history.set_torn(2, 0, 1, tear.encode());
        history.set_pins(Pins { stamp: stamp(2), ..Pins::default() }.encode());
        keep(&mut history, 2..3, 100);
        let torn = |step| {
            let past = history.find(step, Toward::Before, PAGE).unwrap();
            let Ok(Message::Past(head)) = decode(&past.messages[0]) else { panic!("not PAST") };
            assert_eq!((head.stamp.step, head.count), (step, past.messages.len() - 1));
            let Ok(Message::Tear(tear)) = decode(&past.messages[1]) else { panic!("not TEAR") };
            assert!(matches!(decode(&past.messages[2]), Ok(Message::Pins(_))));
            (tear.first, tear.constraints())
        };
        assert_eq!((torn(1), torn(2)), ((0, vec![]), (0, vec![7])));
        // A list that is replaced is that of a rewind, and no new tear.
        history.set_torn(3, 0, 3, tear.encode());
        let marks = history.take_change().unwrap().marks;
        assert_eq!((marks.len(), marks[0].step, marks[0].count), (1, 2, 1));
    }

    #[test]
    fn a_load_forgets_the_past_and_a_repeated_step_is_kept_once() {
        let mut history = History::default();
        keep(&mut history, [1, 1, 2, 2].into_iter(), 100);
        assert_eq!(steps(&history), [1, 2]);
        history.begin_load(60);
        assert!(steps(&history).is_empty() && history.size_bytes == 0);
        assert_eq!(history.take_change().map(|text| text.first_step), Some(None));
        assert_eq!(history.take_change(), None);
    }

    #[test]
    fn marks_are_bounded_and_near_ones_are_merged() {
        let mut history = History::default();
        history.begin_load(200);
        for step in 0..10 {
            history.add_mark(Mark::new(MarkKind::Tear, step, 2));
            history.add_mark(Mark::new(MarkKind::Command, step, 1));
        }
        let text = history.take_change().unwrap();
        let marks: Vec<_> =
            text.marks.iter().map(|mark| (mark.kind, mark.step, mark.count)).collect();
        assert_eq!(marks, [(MarkKind::Tear, 0, 20), (MarkKind::Command, 0, 10)]);
        for step in 0..10_000 {
            history.add_mark(Mark::new(MarkKind::Tear, 100 * step, 1));
        }
        let marks = history.take_change().unwrap().marks;
        assert!(marks.len() == HISTORY_MARKS_MAX && marks.is_sorted_by_key(|mark| mark.step));
    }
}
