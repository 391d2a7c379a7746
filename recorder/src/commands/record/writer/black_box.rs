//! The black box: the last seconds of a recording, in memory until a file of them is to be written.

use std::collections::VecDeque;
use std::time::Duration;

use recording::{Closing, Message, Topic};
use sim_host::clock::SECOND_NS;

use crate::cli::output;
use crate::commands::record::queue::{Content, FileEnd, Item};
use crate::commands::record::start::RunHeader;

/// Parts that are kept in any case: the one in progress, and the one before it, so that there is always
/// something before an event.
const PARTS_MIN: usize = 2;

/// Keeps parts of a recording that follow each other. Each begins with everything that a file needs, so the
/// oldest one kept begins the file.
#[derive(Debug)]
pub(crate) struct BlackBox {
    span: Duration,
    limit_bytes: usize,
    parts: VecDeque<Part>,
    size_bytes: usize,
    /// An event has arrived, so what came before it stays until its file is written.
    has_event: bool,
    is_warned: bool,
}

#[derive(Debug)]
struct Part {
    header: Box<RunHeader>,
    log_time_ns: u64,
    /// CLOCK_MONOTONIC at its beginning. The wall clock of `log_time_ns` may be set meanwhile.
    begin_ns: u64,
    items: Vec<Item>,
    size_bytes: usize,
    closing: Closing,
}

/// A file to write.
#[derive(Debug)]
pub(crate) struct KeptFile {
    pub(crate) header: Box<RunHeader>,
    pub(crate) log_time_ns: u64,
    pub(crate) items: Vec<Item>,
    pub(crate) closing: Closing,
}

impl BlackBox {
    /// Keeps what was received within `span`, in at most `limit_bytes`. Beyond that, it keeps [`PARTS_MIN`]
    /// parts, and what comes before an event until its file is written.
    pub(crate) fn new(span: Duration, limit_bytes: usize) -> Self {
        Self {
            span,
            limit_bytes,
            parts: VecDeque::new(),
            size_bytes: 0,
            has_event: false,
            is_warned: false,
        }
    }

    /// Returns the size of what is kept, in bytes.
    pub(crate) fn size_bytes(&self) -> usize {
        self.size_bytes
    }

    /// Begins a part at `now_ns` of CLOCK_MONOTONIC.
    pub(crate) fn begin(&mut self, header: Box<RunHeader>, log_time_ns: u64, now_ns: u64) {
        let size_bytes = header.scene.len();
        self.size_bytes += size_bytes;
        let (items, closing) = (Vec::new(), Closing::default());
        let begin_ns = now_ns;
        self.parts.push_back(Part { header, log_time_ns, begin_ns, items, size_bytes, closing });
    }

    pub(crate) fn push(&mut self, item: Item) {
        let Some(part) = self.parts.back_mut() else { return };
        let size_bytes = item.content.size_bytes();
        self.has_event |= item.content.event().is_some();
        part.size_bytes += size_bytes;
        part.items.push(item);
        self.size_bytes += size_bytes;
        while self.size_bytes > self.limit_bytes && self.parts.len() > PARTS_MIN && !self.has_event
        {
            self.warn_once();
            self.remove_oldest();
        }
    }

    /// Ends a part at `now_ns` of CLOCK_MONOTONIC. Returns the file to write, if there is one.
    pub(crate) fn end(&mut self, closing: Closing, end: FileEnd, now_ns: u64) -> Option<KeptFile> {
        self.parts.back_mut()?.closing = closing;
        match end {
            FileEnd::Write => self.take_all(),
            FileEnd::KeepAll => {
                // A signal is no content, so only its part shows that it has come.
                self.has_event = true;
                None
            }
            FileEnd::Keep => {
                self.remove_before(now_ns);
                None
            }
            FileEnd::Drop => {
                (self.parts, self.size_bytes, self.has_event) = (VecDeque::new(), 0, false);
                None
            }
        }
    }

    /// Removes the parts that the span does not reach.
    fn remove_before(&mut self, now_ns: u64) {
        let span_ns = u64::try_from(self.span.as_nanos()).unwrap_or(u64::MAX);
        let begin_ns = now_ns.saturating_sub(span_ns);
        while self.parts.get(1).is_some_and(|second| second.begin_ns <= begin_ns) {
            self.remove_oldest();
        }
    }

    fn remove_oldest(&mut self) {
        self.size_bytes -= self.parts.pop_front().map_or(0, |part| part.size_bytes);
    }

    fn warn_once(&mut self) {
        if !std::mem::replace(&mut self.is_warned, true) {
            let begin_ns = |part: Option<&Part>| part.map_or(0, |part| part.begin_ns);
            let kept_ns = begin_ns(self.parts.back()) - begin_ns(self.parts.front());
            output::note(&format!(
                "warning: the black box keeps about the last {:.1} s instead of {}, because {} bytes hold no \
                 more; enlarge --queue-bytes",
                kept_ns as f64 / SECOND_NS as f64,
                humantime::format_duration(self.span),
                self.limit_bytes
            ));
        }
    }

    /// Joins all parts to one file.
    fn take_all(&mut self) -> Option<KeptFile> {
        (self.size_bytes, self.has_event) = (0, false);
        let mut parts = std::mem::take(&mut self.parts).into_iter();
        let Part { header, log_time_ns, items, closing, .. } = parts.next()?;
        let mut file = KeptFile { header, log_time_ns, items, closing };
        for mut part in parts {
            let first_step = part.items.iter().find_map(|item| item.content.snapshot_step());
            part.items.retain(|item| !repeats(&item.content, first_step, &mut part.closing));
            file.items.append(&mut part.items);
            file.closing.counts.add(&part.closing.counts);
            file.closing.unreadable += part.closing.unreadable;
            file.closing.stop_reason = part.closing.stop_reason;
        }
        Some(file)
    }
}

/// Returns `true` for a message at the beginning of a part that a file needs only at its own beginning: the
/// load, and values of earlier steps. Takes it out of the received ones.
fn repeats(content: &Content, first_step: Option<u64>, closing: &mut Closing) -> bool {
    let Content::Update(message) = content else { return false };
    let topic = message.topic();
    let is_load = matches!(topic, Topic::Topology | Topic::Surface);
    let is_earlier = first_step.is_some_and(|first| message.step() < first);
    let is_repeated = is_load || is_earlier && !matches!(message, Message::Step(_));
    closing.counts[topic].received -= u64::from(is_repeated);
    is_repeated
}

#[cfg(test)]
mod tests {
    use recording::{AllCounts, ParametersRow, ParticleBuffer, StepRow, TearsRow};
    use sim_contract::ParameterValues;

    use super::*;
    use crate::commands::record::writer::tests::header;

    fn update(message: Message, second: u64) -> Item {
        Item { content: Content::Update(message), log_time_ns: second * SECOND_NS }
    }

    fn parameters(step: u64) -> Message {
        Message::Parameters(ParametersRow { step, values: ParameterValues::default() })
    }

    /// Adds a part of one second with one step each, whose parameters are those of step 0.
    fn add_part(black_box: &mut BlackBox, second: u64, end: FileEnd) -> Option<KeptFile> {
        // The wall clock goes back.
        black_box.begin(Box::new(header()), 1000 - second, second * SECOND_NS);
        black_box.push(update(parameters(0), second));
        let row = StepRow { step: second, ..StepRow::default() };
        let content = Content::Snapshot(row, ParticleBuffer::default());
        black_box.push(Item { content, log_time_ns: second * SECOND_NS + 1 });
        let mut counts = AllCounts::default();
        counts[Topic::Parameters].received = 1;
        counts[Topic::Steps].received = 1;
        counts[Topic::Steps].gaps = u64::from(second == 4);
        let closing = Closing { stop_reason: format!("end {second}"), counts, unreadable: 1 };
        black_box.end(closing, end, (second + 1) * SECOND_NS)
    }

    fn steps(file: &KeptFile) -> Vec<u64> {
        file.items.iter().filter_map(|item| item.content.snapshot_step()).collect()
    }

    #[test]
    fn a_file_has_the_parts_within_the_span_and_repeats_nothing() {
        let mut black_box = BlackBox::new(Duration::from_secs(3), usize::MAX);
        for second in 0..6 {
            assert!(add_part(&mut black_box, second, FileEnd::Keep).is_none());
        }
        let file = add_part(&mut black_box, 6, FileEnd::Write).unwrap();
        assert_eq!(steps(&file), [3, 4, 5, 6]);
        let repeated = file.items.iter().filter(|item| item.content.snapshot_step().is_none());
        assert_eq!(repeated.count(), 1, "the parameters at the beginning");
        let counts = &file.closing.counts;
        assert_eq!((counts[Topic::Steps].received, counts[Topic::Parameters].received), (4, 1));
        assert_eq!((counts[Topic::Steps].gaps, file.closing.unreadable), (1, 4));
        assert_eq!(file.closing.stop_reason, "end 6");
        assert_eq!((black_box.parts.len(), black_box.size_bytes()), (0, 0));
        let next = add_part(&mut black_box, 7, FileEnd::Write).unwrap();
        assert_eq!(steps(&next), [7], "no step is in two files");
    }

    #[test]
    fn a_file_to_come_keeps_older_parts_and_a_part_without_a_successor_is_dropped() {
        let mut black_box = BlackBox::new(Duration::from_secs(1), usize::MAX);
        for second in 0..6 {
            add_part(&mut black_box, second, FileEnd::KeepAll);
        }
        assert_eq!(steps(&add_part(&mut black_box, 6, FileEnd::Write).unwrap()).len(), 7);
        add_part(&mut black_box, 7, FileEnd::Keep);
        assert!(add_part(&mut black_box, 8, FileEnd::Drop).is_none());
        assert_eq!(steps(&add_part(&mut black_box, 9, FileEnd::Write).unwrap()), [9]);
    }

    #[test]
    fn the_memory_is_limited_except_for_the_newest_parts_and_those_of_an_event() {
        let mut black_box = BlackBox::new(Duration::from_secs(100), 1);
        for second in 0..6 {
            add_part(&mut black_box, second, FileEnd::Keep);
            assert!(black_box.parts.len() <= PARTS_MIN);
        }
        let tears = TearsRow { step: 5, constraints: vec![1], causes: vec!["cut".to_owned()] };
        black_box.push(update(Message::Tears(tears), 5));
        for second in 6..9 {
            add_part(&mut black_box, second, FileEnd::KeepAll);
        }
        let file = add_part(&mut black_box, 9, FileEnd::Write).unwrap();
        assert_eq!(steps(&file), [4, 5, 6, 7, 8, 9]);
        // A signal shows only in the end of a part.
        for second in 10..14 {
            add_part(&mut black_box, second, FileEnd::KeepAll);
        }
        assert_eq!(steps(&add_part(&mut black_box, 14, FileEnd::Write).unwrap()).len(), 5);
    }
}
