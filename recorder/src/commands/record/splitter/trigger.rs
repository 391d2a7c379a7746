//! The events for which a black box is written.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use signal_hook::consts::SIGUSR1;
use signal_hook::flag;

use crate::commands::record::queue::{Content, Event, FileEnd};

/// Shortest time from the last event to the end of the file, so that the file shows what follows it. Events
/// that follow each other within it are in one file.
const TAIL: Duration = Duration::from_secs(1);
/// Most marks that a reason names. It counts the others.
const MARKS_MAX: usize = 8;

/// SIGUSR1, which otherwise ends a process.
#[derive(Debug, Clone, Default)]
pub(crate) struct UserSignal {
    has_arrived: Arc<AtomicBool>,
}

impl UserSignal {
    /// Watches for the signal.
    ///
    /// # Errors
    /// The system refuses the handler.
    pub(crate) fn install() -> io::Result<Self> {
        let signal = Self::default();
        flag::register(SIGUSR1, Arc::clone(&signal.has_arrived))?;
        Ok(signal)
    }

    /// Returns `true` once after the signal has arrived.
    pub(crate) fn take(&self) -> bool {
        self.has_arrived.swap(false, Ordering::Relaxed)
    }
}

/// The end of a part of the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PartEnd {
    /// No other part continues it.
    Last,
    /// The next part continues it.
    Continued,
    /// The next part continues it, and the memory of the black box is full after an event.
    Full,
}

/// Decides when the black box is written, and why.
#[derive(Debug)]
pub(crate) struct Trigger {
    /// Longest time from the first event to the end of the file.
    span: Duration,
    signal: UserSignal,
    /// The events since the last file.
    events: Option<Events>,
}

/// The events of a file.
#[derive(Debug)]
struct Events {
    /// CLOCK_MONOTONIC, in nanoseconds.
    first_ns: u64,
    last_ns: u64,
    /// Step of the last event.
    last_step: u64,
    marks: Vec<String>,
    more_marks: u64,
    tears: Tally,
    frozen: Tally,
    is_signalled: bool,
}

/// Events of one kind.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    first_step: u64,
    count: usize,
}

impl Tally {
    fn add(&mut self, step: u64, count: usize) {
        if self.count == 0 {
            self.first_step = step;
        }
        self.count += count;
    }

    /// Describes the events with their name, for one and for several.
    fn text(self, one: &str, several: &str) -> Option<String> {
        let Self { first_step, count } = self;
        match count {
            0 => None,
            1 => Some(format!("{one} at step {first_step}")),
            _ => Some(format!("{count} {several} from step {first_step} on")),
        }
    }
}

impl Events {
    fn begin(now_ns: u64) -> Self {
        Self {
            first_ns: now_ns,
            last_ns: now_ns,
            last_step: 0,
            marks: Vec::new(),
            more_marks: 0,
            tears: Tally::default(),
            frozen: Tally::default(),
            is_signalled: false,
        }
    }

    fn add_mark(&mut self, mark: String) {
        if self.marks.len() < MARKS_MAX { self.marks.push(mark) } else { self.more_marks += 1 }
    }

    /// Describes the events for the stop reason of the file.
    fn reason(self) -> String {
        let more = (self.more_marks > 0).then(|| format!("{} more marks", self.more_marks));
        let signal = self.is_signalled.then(|| "SIGUSR1".to_owned());
        let tears = self.tears.text("tear", "tears");
        let frozen = self.frozen.text("frozen particle", "frozen particles");
        let parts = [more, tears, frozen, signal].into_iter().flatten();
        self.marks.into_iter().chain(parts).collect::<Vec<_>>().join(", ")
    }
}

impl Trigger {
    /// Watches for the signal, too.
    pub(crate) fn new(span: Duration, signal: UserSignal) -> Self {
        Self { span, signal, events: None }
    }

    /// Notices the signal.
    pub(crate) fn poll_signal(&mut self, now_ns: u64) {
        if self.signal.take() {
            self.events_at(now_ns).is_signalled = true;
        }
    }

    /// Notices the event of a content, if it is one.
    pub(crate) fn watch(&mut self, content: &Content, now_ns: u64) {
        let Some(event) = content.event() else { return };
        let events = self.events_at(now_ns);
        events.last_step = events.last_step.max(event.step());
        match event {
            Event::Mark { step, text } => events.add_mark(format!("mark '{text}' at step {step}")),
            Event::Tears { step, count } => events.tears.add(step, count),
            Event::Frozen { step } => events.frozen.add(step, 1),
        }
    }

    /// Returns the events of the file to come, with one at `now_ns`.
    fn events_at(&mut self, now_ns: u64) -> &mut Events {
        let events = self.events.get_or_insert_with(|| Events::begin(now_ns));
        events.last_ns = now_ns;
        events
    }

    /// Returns `true` if there is an event whose file is not written, and the file shows its effect.
    /// `last_step` is the last recorded step.
    pub(crate) fn has_shown_event(&self, last_step: Option<u64>) -> bool {
        self.events.as_ref().is_some_and(|events| last_step >= Some(events.last_step))
    }

    /// Returns `true` if the file can end.
    pub(crate) fn is_due(&self, now_ns: u64) -> bool {
        let since = |ns: u64| Duration::from_nanos(now_ns.saturating_sub(ns));
        self.events.as_ref().is_some_and(|events| {
            since(events.last_ns) >= TAIL || since(events.first_ns) >= self.span
        })
    }

    /// Ends a part of the recording. Returns its reason, and the treatment of the part.
    pub(crate) fn end_part(
        &mut self,
        stop_reason: String,
        end: PartEnd,
        now_ns: u64,
    ) -> (String, FileEnd) {
        let is_written = end != PartEnd::Continued || self.is_due(now_ns);
        match self.events.take_if(|_| is_written) {
            Some(events) => (events.reason(), FileEnd::Write),
            None if self.events.is_some() => (stop_reason, FileEnd::KeepAll),
            None if end == PartEnd::Last => (stop_reason, FileEnd::Drop),
            None => (stop_reason, FileEnd::Keep),
        }
    }
}

#[cfg(test)]
mod tests {
    use recording::{EventRow, Message, OutcomeRow, TearsRow};
    use sim_contract::{Action, Command, Outcome, Reason, TearCause, Text, TornConstraint};
    use sim_host::clock::SECOND_NS;

    use super::*;

    fn trigger() -> Trigger {
        Trigger::new(Duration::from_secs(10), UserSignal::default())
    }

    fn tear(step: u64) -> Content {
        let torn = TornConstraint::new(3, Some(TearCause::Stretch));
        Content::Update(Message::Tears(TearsRow::new(step, &[torn])))
    }

    fn mark(result: Result<(), Reason>) -> Content {
        let action = Action::Mark { text: Text::cut("slips") };
        let outcome = Outcome::new(0, 7, Command::new(1, 1, action), result);
        Content::Update(Message::Outcome(OutcomeRow::from(&outcome)))
    }

    #[test]
    fn a_mark_a_tear_a_frozen_particle_and_the_signal_are_events() {
        let event = |kind: &str| {
            let (kind, text) = (kind.to_owned(), String::new());
            let row = EventRow { step: 9, kind, particle: Some(1), client_id: None, text };
            Content::Update(Message::Event(row))
        };
        let mut trigger = trigger();
        for content in [mark(Err(Reason::OutOfRange)), event("member_joined")] {
            trigger.watch(&content, 0);
        }
        trigger.poll_signal(0);
        assert!(trigger.events.is_none());
        for content in [mark(Ok(())), tear(8), tear(9), event("frozen")] {
            trigger.watch(&content, 0);
        }
        trigger.signal.has_arrived.store(true, Ordering::Relaxed);
        trigger.poll_signal(0);
        trigger.poll_signal(0);
        assert_eq!(
            trigger.end_part("split".to_owned(), PartEnd::Last, 0).0,
            "mark 'slips' at step 7, 2 tears from step 8 on, frozen particle at step 9, SIGUSR1"
        );
        for _ in 0..MARKS_MAX + 3 {
            trigger.watch(&mark(Ok(())), 0);
        }
        trigger.watch(&tear(8), 0);
        let reason = trigger.end_part("split".to_owned(), PartEnd::Last, 0).0;
        assert!(
            reason.ends_with("mark 'slips' at step 7, 3 more marks, tear at step 8"),
            "{reason}"
        );
    }

    #[test]
    fn a_file_ends_a_second_after_the_last_event_and_within_the_span_of_the_first() {
        let mut trigger = trigger();
        let end = |trigger: &mut Trigger, now_ns| {
            trigger.end_part("split".to_owned(), PartEnd::Continued, now_ns).1
        };
        assert_eq!(end(&mut trigger, SECOND_NS), FileEnd::Keep);
        trigger.watch(&tear(1), SECOND_NS);
        assert_eq!(end(&mut trigger, 2 * SECOND_NS - 1), FileEnd::KeepAll);
        assert_eq!(end(&mut trigger, 2 * SECOND_NS), FileEnd::Write);
        assert_eq!(end(&mut trigger, 3 * SECOND_NS), FileEnd::Keep);
        let mut written = Vec::new();
        for half_s in 10..40 {
            trigger.watch(&tear(half_s), half_s * SECOND_NS / 2);
            if end(&mut trigger, half_s * SECOND_NS / 2) == FileEnd::Write {
                written.push(half_s);
            }
        }
        assert_eq!(written, [30], "10 s after the first tear");
    }

    #[test]
    fn a_part_that_no_other_continues_is_written_only_after_an_event() {
        let mut trigger = trigger();
        let end = |trigger: &mut Trigger| trigger.end_part("signal".to_owned(), PartEnd::Last, 0);
        assert_eq!(end(&mut trigger), ("signal".to_owned(), FileEnd::Drop));
        trigger.watch(&tear(4), 0);
        assert_eq!(end(&mut trigger), ("tear at step 4".to_owned(), FileEnd::Write));
    }
}
