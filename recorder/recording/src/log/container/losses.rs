//! The losses of a repair: messages by topic, and steps by range.

use std::collections::BTreeMap;

use super::content::ContentCheck;
use crate::log::run::Closing;
use crate::log::topic::{AllCounts, Topic};

/// Most ranges that a repair lists. It counts the others.
const RANGES_MAX: usize = 1000;

/// Content that damage before the metadata `run` has taken from a file without a scene.
pub(super) const LOST_SCENE: &str =
    "the scene, so the result cannot be verified, and perhaps the selection";
/// Content that damage before the metadata `run` may have taken from a file with a scene.
pub(super) const LOST_SELECTION: &str = "a part before the metadata 'run', perhaps the selection";

/// A range of steps without snapshots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LostSteps {
    /// The newest snapshot before the range, if there is one.
    pub after: Option<u64>,
    /// The first snapshot after the range, if there is one.
    pub before: Option<u64>,
}

impl std::fmt::Display for LostSteps {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.after, self.before) {
            (Some(after), Some(before)) if after + 2 == before => {
                write!(formatter, "{}", after + 1)
            }
            (Some(after), Some(before)) => write!(formatter, "{}..={}", after + 1, before - 1),
            (Some(after), None) => write!(formatter, "from {} on", after + 1),
            (None, Some(before)) => write!(formatter, "before {before}"),
            (None, None) => formatter.write_str("all"),
        }
    }
}

/// The messages and steps that a repair leaves out.
#[derive(Debug, Default)]
pub struct Losses {
    /// Lost messages whose topic is known. Only `lost` is set.
    counts: AllCounts,
    /// Damaged messages of unknown topics.
    unknown_count: u64,
    ranges: Vec<LostSteps>,
    more_ranges: u64,
    /// The newest copied snapshot.
    last_step: Option<u64>,
    /// Something is lost since the newest copied snapshot.
    is_open: bool,
    /// A part of the file is lost whose content is unknown.
    has_lost_part: bool,
    /// The content that damage before the description of the run may have taken.
    head: Option<&'static str>,
    lost_attachments: u64,
}

impl Losses {
    /// Returns the ranges of steps with losses.
    pub fn ranges(&self) -> &[LostSteps] {
        &self.ranges
    }

    /// Returns the number of further ranges, which are not listed.
    pub fn more_ranges(&self) -> u64 {
        self.more_ranges
    }

    /// Returns the ranges of steps with losses, as text.
    pub fn steps(&self) -> Vec<String> {
        let more = (self.more_ranges > 0).then(|| format!("{} more ranges", self.more_ranges));
        self.ranges.iter().map(ToString::to_string).chain(more).collect()
    }

    /// Returns what is lost, as lines for people.
    pub fn lines(&self) -> Vec<String> {
        let (steps, messages) = (self.steps(), self.messages());
        let counts: Vec<_> =
            messages.iter().map(|(topic, count)| format!("{topic} {count}")).collect();
        let steps = (!steps.is_empty()).then(|| format!("steps {}", steps.join(", ")));
        let counts = (!counts.is_empty()).then(|| format!("messages: {}", counts.join(", ")));
        self.head.map(str::to_owned).into_iter().chain(steps).chain(counts).collect()
    }

    /// Returns the number of lost messages by topic, as far as the file tells.
    pub fn messages(&self) -> BTreeMap<&'static str, u64> {
        let counts = self.counts.iter().map(|(topic, counts)| (topic.name(), counts.lost));
        let others = [("unknown", self.unknown_count), ("attachments", self.lost_attachments)];
        let all = counts.chain(others);
        all.filter(|(_, count)| *count > 0).collect()
    }

    /// Returns `true` if nothing is lost.
    pub fn is_empty(&self) -> bool {
        !self.has_lost_part
            && self.head.is_none()
            && self.ranges.is_empty()
            && self.messages().is_empty()
    }

    /// Returns the content that damage before the description of the run may have taken, for people.
    pub fn head(&self) -> Option<&'static str> {
        self.head
    }

    /// Counts an attachment that is left out. No message is missing by it.
    pub(super) fn add_attachment(&mut self) {
        self.lost_attachments = self.lost_attachments.saturating_add(1);
    }

    /// Marks content before the description of the run as lost. No step is missing by it.
    pub(super) fn lose_head(&mut self, what: &'static str) {
        self.head = Some(what);
    }

    /// Marks a part of the file as lost.
    pub(super) fn add_part(&mut self) {
        self.is_open = true;
        self.has_lost_part = true;
    }

    pub(super) fn add_message(&mut self, topic: Option<Topic>) {
        self.is_open = true;
        match topic {
            Some(topic) => self.counts[topic].lost += 1,
            None => self.unknown_count += 1,
        }
    }

    /// Adds the messages of a damaged chunk, as its message index counts them.
    pub(super) fn add_indexed(&mut self, topic: Option<Topic>, count: u64) {
        match topic {
            // It is rewritten.
            Some(Topic::Tf) => {}
            Some(topic) => self.counts[topic].lost += count,
            None => self.unknown_count += count,
        }
    }

    /// Removes the loss of a message that follows from the rest of the file.
    pub(super) fn restore(&mut self, topic: Topic) {
        let lost = &mut self.counts[topic].lost;
        *lost = lost.saturating_sub(1);
    }

    /// Ends a gap at a sound snapshot.
    pub(super) fn end_gap(&mut self, step: u64) {
        if self.is_open && self.last_step.is_none_or(|last| last.saturating_add(1) < step) {
            self.add_range(Some(step));
        }
        self.is_open = false;
        self.last_step = Some(step);
    }

    pub(super) fn finish(&mut self) {
        if self.is_open {
            self.add_range(None);
        }
    }

    fn add_range(&mut self, before: Option<u64>) {
        if self.ranges.len() < RANGES_MAX {
            self.ranges.push(LostSteps { after: self.last_step, before });
        } else {
            self.more_ranges += 1;
        }
    }

    /// Returns the closing metadata with the losses. `reason` is for a file that had none.
    pub(super) fn declare(
        &mut self,
        closing: Option<Closing>,
        reason: &str,
        content: &ContentCheck,
    ) -> Closing {
        let had_end = closing.is_some();
        let mut closing = closing
            .unwrap_or_else(|| Closing { stop_reason: reason.to_owned(), ..Closing::default() });
        let gaps = content.gaps.counts();
        let has_losses = !self.is_empty();
        for topic in Topic::ALL {
            let counts = &mut closing.counts[topic];
            let written = content.counts[topic].written;
            // The end of the file has the number of messages that were written. It is exact where damage hides messages,
            // or a message is there twice.
            let missing = counts.written.checked_sub(written).filter(|_| counts.written > 0);
            if let Some(missing) = missing
                && had_end
                && topic != Topic::Tf
            {
                self.counts[topic].lost = missing;
            }
            counts.lost = counts.lost.saturating_add(self.counts[topic].lost);
            let declared = counts.lost.saturating_add(counts.gaps);
            let more = gaps[topic].gaps.saturating_sub(declared);
            counts.lost = counts.lost.saturating_add(more);
            // Gaps of a file that declares no losses are those of the repair only if it left something out.
            if has_losses {
                self.counts[topic].lost = self.counts[topic].lost.max(more);
            }
            counts.written = written;
            if !had_end {
                counts.received = counts.written.saturating_add(counts.lost);
            }
        }
        closing
    }

    /// Adds the losses to the metadata of the repair.
    pub(super) fn add_to(&self, repair: &mut BTreeMap<String, String>) {
        for (topic, count) in self.messages() {
            let key = format!("lost.{}", topic.trim_start_matches('/'));
            repair.insert(key, count.to_string());
        }
        if let Some(what) = self.head {
            repair.insert("lost_head".to_owned(), what.to_owned());
        }
        let texts: Vec<_> = self.ranges.iter().map(ToString::to_string).collect();
        repair.insert("lost_steps".to_owned(), texts.join(", "));
        if self.more_ranges > 0 {
            repair.insert("more_lost_ranges".to_owned(), self.more_ranges.to_string());
        }
    }
}
