//! The way from the states of a tap into the queue: one file after the other.

pub(crate) mod selector;
pub(crate) mod trigger;

use std::sync::Arc;

use recording::{AllCounts, Closing, ContentSelection, RunDescription, counted};
use sim_contract::{LostChanges, ReadError, State, StatusFlags};
use sim_host::clock::{SECOND_NS, monotonic_ns, realtime_ns};

use super::batch::{Batch, Messages, RunEnd, StopReason};
use super::queue::{Content, FileEnd, Item, Queue};
use super::session::{Session, Skipped};
use super::split::{FileBegin, FirstStep, SplitArgs, TimeLimit, WritePosition};
use super::start::{FirstState, LoadError, Now};
use crate::cli::output;
use selector::Selector;
use trigger::{PartEnd, Trigger};

/// Shortest part of a black box. A part repeats the scene and the constraints.
const PART_MIN_NS: u64 = SECOND_NS;

/// The division of a recording into files, and its end.
#[derive(Debug, Default)]
pub(crate) struct SplitOptions {
    pub(crate) split: SplitArgs,
    /// Another load and another run begin the next file.
    pub(crate) is_following: bool,
    pub(crate) selection: ContentSelection,
    pub(crate) time_limit: Option<TimeLimit>,
    /// Decides when the black box is written, if this is one.
    pub(crate) trigger: Option<Trigger>,
    /// Memory of the black box.
    pub(crate) limit_bytes: u64,
}

/// Divides the states of a session into the files of a recording, and passes them to the queue.
#[derive(Debug)]
pub(crate) struct Splitter {
    session: Session,
    queue: Arc<Queue>,
    position: Arc<WritePosition>,
    options: SplitOptions,
    selector: Selector,
    is_paused: bool,
    /// The newest file.
    file: Option<FileBegin>,
    /// Contents of the newest file that are not in the queue yet.
    batch: Batch,
}

impl Splitter {
    pub(crate) fn new(
        session: Session,
        queue: Arc<Queue>,
        position: Arc<WritePosition>,
        options: SplitOptions,
    ) -> Self {
        Self {
            session,
            queue,
            position,
            selector: Selector::new(options.selection),
            options,
            is_paused: false,
            file: None,
            batch: Batch::default(),
        }
    }

    /// Accepts a state, in the next file if this one ends before it. `messages` have arrived before it.
    pub(crate) fn accept_state(
        &mut self,
        state: &State<'_>,
        messages: &mut Messages,
    ) -> Result<(), LoadError> {
        if let Some(reason) = self.end_before(state) {
            self.session.accept_before(state, messages, &mut self.batch);
            let is_split = reason == StopReason::Split;
            let end = if is_split { PartEnd::Continued } else { PartEnd::Last };
            self.end_part(reason.text().to_owned(), end);
        }
        self.batch.spare = self.queue.take_spare();
        self.delay_file();
        self.session.accept_state(state, Now::read(), &mut self.batch)
    }

    /// Delays the next file while the disk stalls, so that the starts of files do not fill the memory.
    fn delay_file(&mut self) {
        let is_delayed = !self.session.has_started() && !self.queue.has_room();
        if is_delayed && !self.session.is_delayed() {
            output::note(
                "warning: the disk does not keep up, and --queue-bytes of messages wait for it; the next file begins \
                 when it has caught up, and declares the snapshots before it as missing",
            );
        }
        self.session.delay(is_delayed);
    }

    /// Returns the reason why another file begins with a state.
    fn end_before(&self, state: &State<'_>) -> Option<StopReason> {
        match self.session.end_at(state.header) {
            Some(RunEnd::EndStep) => None,
            Some(end) => self.options.is_following.then_some(StopReason::Run(end)),
            None => self.is_split_before(state).then_some(StopReason::Split),
        }
    }

    fn is_split_before(&self, state: &State<'_>) -> bool {
        let Some(file) = self.file.filter(|_| self.session.has_started()) else { return false };
        let now_ns = monotonic_ns();
        let is_due = match &self.options.trigger {
            Some(trigger) => {
                now_ns.saturating_sub(file.monotonic_ns) >= PART_MIN_NS
                    || trigger.is_due(now_ns)
                    || trigger.has_shown_event(self.session.last_step()) && self.is_full(1)
            }
            None => {
                self.options.split.is_due(file, &self.position, self.queue.size_bytes(), now_ns)
            }
        };
        is_due && self.queue.has_room() && FirstState::is_complete(state)
    }

    /// Accepts messages that arrived between states, and passes everything to the queue. Returns the end
    /// of the recording, if it is reached.
    pub(crate) fn accept_messages(&mut self, messages: Messages) -> Option<RunEnd> {
        let was_paused = self.is_paused;
        if let Some(status) = messages.statuses.last() {
            self.is_paused = status.flags & StatusFlags::PAUSED != 0;
        }
        self.session.accept_messages(messages, Now::read(), &mut self.batch);
        let is_snapshot = |content: &Content| content.snapshot_step().is_some();
        let has_snapshot = self.batch.contents.iter().any(is_snapshot);
        self.enqueue();
        if self.is_paused && !(was_paused && has_snapshot) {
            // No other snapshot comes during the pause, so the messages behind this snapshot must not
            // wait for one.
            self.push_last_snapshot();
        }
        self.end_part_early();
        self.batch.end.take()
    }

    /// Returns `true` if the time of the recording is over.
    pub(crate) fn is_time_over(&self, now_ns: u64) -> bool {
        let limit = self.options.time_limit.as_ref();
        limit.is_some_and(|limit| limit.is_reached(self.session.last(), now_ns))
    }

    /// Returns `true` if the recording ends.
    pub(crate) fn is_at_end(&self) -> bool {
        self.batch.end.is_some()
    }

    /// Returns the number of the newest file, from 0.
    pub(crate) fn file_number(&self) -> u64 {
        self.file.map_or(0, |file| file.number)
    }

    /// Returns the run in the file, once one has begun.
    pub(crate) fn run_id(&self) -> Option<u64> {
        self.session.run_id()
    }

    /// Ends the file if it belongs to this run. Returns `true` if it does.
    pub(crate) fn end_file_of(&mut self, run_id: u64, stop_reason: &str) -> bool {
        let is_of_run = self.run_id() == Some(run_id);
        if is_of_run {
            self.end_file(stop_reason.to_owned());
        }
        is_of_run
    }

    /// Ends the file, if one has begun.
    pub(crate) fn end_file(&mut self, stop_reason: String) {
        self.session.accept_rest(&mut self.batch);
        self.end_part(stop_reason, PartEnd::Last);
    }

    /// Ends the file, or a part of a black box that the next one may continue.
    fn end_part(&mut self, stop_reason: String, end: PartEnd) {
        self.enqueue();
        if !self.session.has_started() {
            return;
        }
        let (is_full, last_step) = (self.is_full(1), self.session.last_step());
        let (stop_reason, end) = match &mut self.options.trigger {
            Some(trigger) => {
                let is_full = is_full && trigger.has_shown_event(last_step);
                let is_continued = end == PartEnd::Continued;
                let end = if is_continued && is_full { PartEnd::Full } else { end };
                trigger.end_part(stop_reason, end, monotonic_ns())
            }
            None => (stop_reason, FileEnd::Write),
        };
        if end == FileEnd::Write {
            self.push_last_snapshot();
        } else {
            let queue = &self.queue;
            self.selector.push_waiting(&mut |item| queue.push(item));
        }
        let mut closing = self.session.end_file(stop_reason);
        closing.counts.set_left_out(&self.selector.take_counts());
        self.queue.end(closing, end);
    }

    /// Ends a part for which the black box is to be written while no complete state arrives: in a pause, and
    /// before it takes more than twice its memory. The state after a pause has a keyframe, so the next part
    /// begins with it.
    fn end_part_early(&mut self) {
        let now_ns = monotonic_ns();
        let (is_far_too_full, last_step) = (self.is_full(2), self.session.last_step());
        let Some(trigger) = &mut self.options.trigger else { return };
        trigger.poll_signal(now_ns);
        let is_over = trigger.has_shown_event(last_step) && is_far_too_full;
        if is_over || self.is_paused && trigger.is_due(now_ns) {
            self.end_part(StopReason::Split.text().to_owned(), PartEnd::Continued);
        }
    }

    /// Returns `true` if a black box, and what waits for it, take a multiple of its memory.
    fn is_full(&self, multiple: u64) -> bool {
        let kept_bytes = self.position.get().map_or(0, |(_, size_bytes)| size_bytes);
        let size_bytes = kept_bytes + self.queue.size_bytes() as u64;
        size_bytes > self.options.limit_bytes.saturating_mul(multiple)
    }

    /// Passes what is accepted to the queue, in the order of publication.
    fn enqueue(&mut self) {
        let log_time_ns = realtime_ns();
        self.batch.sort();
        if let Some(header) = self.batch.header.take() {
            let number = self.file.map_or(0, |file| file.number + 1);
            self.file = Some(FileBegin { number, monotonic_ns: monotonic_ns() });
            self.begin_file(&header.run);
            self.warn_of_skipped();
            self.queue.begin(header, log_time_ns);
        }
        self.session.mark_written();
        let now_ns = monotonic_ns();
        for content in self.batch.contents.drain(..) {
            if let Some(trigger) = &mut self.options.trigger {
                trigger.watch(&content, now_ns);
            }
            let queue = &self.queue;
            self.selector.select(Item { content, log_time_ns }, &mut |item| queue.push(item));
        }
    }

    /// Records the last snapshot, if it was left out.
    fn push_last_snapshot(&mut self) {
        let queue = &self.queue;
        self.selector.push_last_snapshot(&mut |item| queue.push(item));
    }

    /// Begins the time of the recording with its first file, and reports the first step.
    fn begin_file(&mut self, run: &RunDescription) {
        let Some(step) = self.session.first_step() else { return };
        let publish_monotonic_ns = self.session.last().map(|header| header.publish_monotonic_ns);
        if let (Some(limit), Some(publish_monotonic_ns)) =
            (&mut self.options.time_limit, publish_monotonic_ns)
        {
            let (run_id, rate_hz) = (run.run_id, run.rate_hz);
            let first = FirstStep { run_id, step, rate_hz, publish_monotonic_ns };
            limit.begin(first, monotonic_ns());
        }
        if self.options.trigger.is_none() {
            output::note(&format!("recording from step {step}"));
        }
    }

    fn warn_of_skipped(&mut self) {
        let Skipped { count, last_step } = self.session.take_skipped();
        if count > 0 {
            let snapshots = counted(count, "snapshot");
            output::note(&format!(
                "warning: the replay began in the middle of a recording and could not publish a complete state \
                 there, so the recording lacks {snapshots} up to step {last_step}, before the first keyframe"
            ));
        }
    }

    /// Returns the number of snapshots that came before the first keyframe of a file.
    pub(crate) fn skipped_count(&self) -> u64 {
        self.session.skipped_count()
    }

    /// Returns the numbers of missing messages since the last file, which no file declares.
    pub(crate) fn undeclared(&self) -> AllCounts {
        self.session.undeclared()
    }

    /// Counts messages that could not be read.
    pub(crate) fn count_unreadable(&mut self, errors: &[ReadError]) {
        if let Some(warning) = self.session.count_unreadable(errors) {
            output::note(&warning);
        }
    }

    /// Returns `true` if a black box is fed.
    pub(crate) fn is_of_black_box(&self) -> bool {
        self.options.trigger.is_some()
    }

    /// Returns the counts of the newest file so far, with what the queue has dropped.
    pub(crate) fn closing(&self) -> Closing {
        let mut closing = if self.session.has_started() {
            self.session.closing(String::new())
        } else {
            Closing::default()
        };
        closing.counts.set_lost(&self.queue.lost());
        closing
    }

    /// Sets the numbers of changes that the tap has dropped so far.
    pub(crate) fn set_lost(&mut self, lost: LostChanges) {
        self.session.set_lost(lost);
    }
}
