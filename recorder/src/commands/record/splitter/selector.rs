//! The snapshots that a recording holds, and the count of those that it leaves out.

use std::num::NonZeroU32;

use recording::{AllCounts, ContentSelection, Message, ParticleBuffer, StepRow, Topic};

use crate::cli::parse::whole_number_in;
use crate::commands::record::queue::{Content, Item};

/// Options that say which part of a run is recorded.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct SelectionArgs {
    /// Record every N-th snapshot, those with a keyframe, and the last one of each file and before each
    /// pause. Commands and tears between them are recorded, so the file can still be verified
    #[arg(long, value_name = "N", default_value = "1", allow_hyphen_values = true,
        value_parser = period)]
    every: NonZeroU32,
    /// Record the commands, and the particles of the first step and then about every ten seconds.
    /// `recorder simulate` computes the others, bit for bit
    #[arg(long, conflicts_with = "every")]
    only_commands: bool,
    /// Record the forces on colliders, anchors and fixed particles in each step, too (/forces). The node
    /// computes them only while a program reads them
    #[arg(long)]
    forces: bool,
    /// Record the energy of each state in its row in /steps, too: kinetic, potential and elastic
    #[arg(long)]
    energy: bool,
}

impl Default for SelectionArgs {
    fn default() -> Self {
        Self { every: NonZeroU32::MIN, only_commands: false, forces: false, energy: false }
    }
}

impl SelectionArgs {
    pub(crate) fn selection(&self) -> ContentSelection {
        let Self { every, only_commands: is_only_commands, forces, energy } = *self;
        ContentSelection { every, is_only_commands, has_forces: forces, has_energy: energy }
    }
}

fn period(text: &str) -> Result<NonZeroU32, String> {
    let number = whole_number_in(text, &(1..=1_000_000))?;
    u32::try_from(number).and_then(NonZeroU32::try_from).map_err(|error| error.to_string())
}

/// In a recording of commands, one keyframe of this number has particles: about one each ten seconds.
const KEYFRAMES_PER_STATE: u32 = 10;

/// Leaves out what is not selected, and counts it.
#[derive(Debug)]
pub(super) struct Selector {
    selection: ContentSelection,
    /// Step of the newest keyframe.
    keyframe_step: Option<u64>,
    /// Number of snapshots with a keyframe since the last one with particles; `None` before the first of
    /// the file.
    keyframes_since_state: Option<u32>,
    /// Step of the newest state that a command put in place. Its particles follow from nothing else.
    in_place_step: Option<u64>,
    /// The newest snapshot with the time of its reception, if it was left out.
    last_left_out: Option<(StepRow, ParticleBuffer, u64)>,
    /// The messages behind that snapshot, until it is known whether the snapshot is recorded before them.
    waiting: Vec<Item>,
    /// Only `left_out` is set.
    counts: AllCounts,
}

impl Selector {
    pub(super) fn new(selection: ContentSelection) -> Self {
        Self {
            selection,
            keyframe_step: None,
            keyframes_since_state: None,
            in_place_step: None,
            last_left_out: None,
            waiting: Vec::new(),
            counts: AllCounts::default(),
        }
    }

    /// Passes on the part of an item that is recorded.
    pub(super) fn select(&mut self, item: Item, push: &mut impl FnMut(Item)) {
        let Item { content, log_time_ns } = item;
        match content {
            Content::Update(message) => {
                match &message {
                    Message::Keyframe { step, .. } => self.keyframe_step = Some(*step),
                    Message::Outcome(row) if row.puts_state_in_place() && row.is_applied() => {
                        self.in_place_step = Some(row.step);
                    }
                    _ => {}
                }
                let item = Item { content: Content::Update(message), log_time_ns };
                if self.last_left_out.is_some() { self.waiting.push(item) } else { push(item) }
            }
            Content::Snapshot(row, particles) => {
                self.push_waiting(push);
                let is_due = self.selection.has_snapshot(row.snapshot_index);
                if is_due || self.keyframe_step == Some(row.step) {
                    push(Item { content: self.recorded_part(row, particles), log_time_ns });
                } else {
                    self.count_snapshots(|left_out| left_out + 1);
                    self.last_left_out = Some((row, particles, log_time_ns));
                }
            }
        }
    }

    /// Passes on what is recorded of the newest snapshot before a pause or at the end of a file, if it was left out: a
    /// file ends where the recording did, not up to a period before.
    pub(super) fn push_last_snapshot(&mut self, push: &mut impl FnMut(Item)) {
        if let Some((row, particles, log_time_ns)) = self.last_left_out.take() {
            self.count_snapshots(|left_out| left_out - 1);
            push(Item { content: self.recorded_part(row, particles), log_time_ns });
        }
        self.push_waiting(push);
    }

    /// Passes on the messages that wait. The snapshot before them stays left out.
    pub(super) fn push_waiting(&mut self, push: &mut impl FnMut(Item)) {
        self.last_left_out = None;
        self.waiting.drain(..).for_each(push);
    }

    fn count_snapshots(&mut self, count: impl Fn(u64) -> u64) {
        for topic in [Topic::Steps, Topic::Particles] {
            self.counts[topic].left_out = count(self.counts[topic].left_out);
        }
    }

    /// Returns what is recorded of a snapshot: all of it, or its header.
    fn recorded_part(&mut self, row: StepRow, particles: ParticleBuffer) -> Content {
        if self.selection.is_only_commands && !self.is_state(row.step) {
            self.counts[Topic::Particles].left_out += 1;
            Content::Update(Message::Step(row))
        } else {
            Content::Snapshot(row, particles)
        }
    }

    /// Returns `true` for a snapshot with particles in a recording of commands.
    fn is_state(&mut self, step: u64) -> bool {
        if self.keyframe_step != Some(step) {
            return false;
        }
        let count = self.keyframes_since_state.map(|count| count + 1);
        let is_due = count.is_none_or(|count| count >= KEYFRAMES_PER_STATE);
        let is_state = is_due || self.in_place_step == Some(step);
        self.keyframes_since_state = if is_state { Some(0) } else { count };
        is_state
    }

    /// Returns the counts of a file, and begins with those of the next one.
    pub(super) fn take_counts(&mut self) -> AllCounts {
        self.keyframes_since_state = None;
        std::mem::take(&mut self.counts)
    }
}

#[cfg(test)]
mod tests {
    use recording::{OutcomeRow, ParticleBuffer, StepRow};
    use sim_contract::{Action, Command, Outcome, Reason};

    use super::*;

    fn snapshot(index: u32) -> Content {
        let step = u64::from(index);
        let row = StepRow { step, snapshot_index: index, ..StepRow::default() };
        Content::Snapshot(row, ParticleBuffer::default())
    }

    fn keyframe(step: u64) -> Content {
        Content::Update(Message::Keyframe { step, bytes: Vec::new() })
    }

    fn every_fourth() -> ContentSelection {
        ContentSelection { every: NonZeroU32::new(4).unwrap(), ..ContentSelection::default() }
    }

    /// Returns what a content that arrives when its step ends passes on.
    fn select(selector: &mut Selector, content: Content) -> Vec<Content> {
        let log_time_ns = match &content {
            Content::Snapshot(row, _) => row.step,
            Content::Update(message) => message.step(),
        };
        let mut passed = Vec::new();
        selector.select(Item { content, log_time_ns }, &mut |item| passed.push(item.content));
        passed
    }

    fn last_steps(selector: &mut Selector) -> Vec<u64> {
        let mut steps = Vec::new();
        selector.push_last_snapshot(&mut |Item { content, log_time_ns }| {
            let step = match &content {
                Content::Snapshot(row, _) => row.step,
                Content::Update(message) => message.step(),
            };
            assert_eq!(log_time_ns, step, "the time of its reception");
            steps.push(step);
        });
        steps
    }

    fn has_snapshot(contents: &[Content]) -> bool {
        contents.iter().any(|content| matches!(content, Content::Snapshot(..)))
    }

    #[test]
    fn snapshots_of_the_period_and_those_with_a_keyframe_are_selected() {
        let mut selector = Selector::new(every_fourth());
        let selected: Vec<_> = (0..10)
            .filter(|step| {
                if *step == 3 {
                    select(&mut selector, keyframe(3));
                }
                has_snapshot(&select(&mut selector, snapshot(*step)))
            })
            .collect();
        assert_eq!(selected, [0, 3, 4, 8]);
        assert_eq!(last_steps(&mut selector), [9]);
        assert_eq!(last_steps(&mut selector), [0; 0], "it is taken once");
        let counts = selector.take_counts();
        assert_eq!((counts[Topic::Particles].left_out, counts[Topic::Steps].left_out), (5, 5));
        assert_eq!(selector.take_counts(), AllCounts::default());
    }

    #[test]
    fn messages_of_the_next_step_follow_the_last_snapshot() {
        let mut selector = Selector::new(every_fourth());
        for index in 0..=8 {
            select(&mut selector, snapshot(index));
        }
        assert_eq!(last_steps(&mut selector), [0; 0], "the last one was selected");
        select(&mut selector, snapshot(9));
        assert_eq!(select(&mut selector, keyframe(10)), []);
        assert_eq!(last_steps(&mut selector), [9, 10]);
        select(&mut selector, snapshot(11));
        select(&mut selector, keyframe(13));
        assert_eq!(select(&mut selector, snapshot(13)).len(), 2, "the keyframe and its snapshot");
    }

    #[test]
    fn a_recording_of_commands_has_the_particles_of_the_first_state_and_of_those_put_in_place() {
        let selection = ContentSelection { is_only_commands: true, ..ContentSelection::default() };
        let mut selector = Selector::new(selection);
        let states = |selector: &mut Selector, steps: std::ops::Range<u32>| {
            let is_state = |step: &u32| {
                select(selector, keyframe(u64::from(*step)));
                has_snapshot(&select(selector, snapshot(*step)))
            };
            steps.filter(is_state).collect::<Vec<_>>()
        };
        assert_eq!(states(&mut selector, 0..25), [0, 10, 20]);
        let rewind = Action::Rewind { to_step: Some(3), back_steps: None };
        for (step, result, expected) in
            [(25, Ok(()), vec![25]), (27, Err(Reason::UnknownStep), vec![])]
        {
            let outcome = Outcome::new(0, step.into(), Command::new(1, 1, rewind), result);
            select(&mut selector, Content::Update(Message::Outcome(OutcomeRow::from(&outcome))));
            assert_eq!(states(&mut selector, step..step + 2), expected);
        }
        assert_eq!(selector.take_counts()[Topic::Particles].left_out, 29 - 4);
        assert_eq!(states(&mut selector, 40..42), [40], "the first one of the next file");
    }
}
