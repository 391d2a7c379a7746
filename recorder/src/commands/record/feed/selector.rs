//! The topics and snapshots that a recording holds, and the count of those that it leaves out.

use std::num::NonZeroU32;

use recorder::{AllCounts, ContentSelection, Message, ParticleBuffer, StepRow, Topic};
use sim_cli::did_you_mean;

use crate::cli::parse::whole_number_in;
use crate::commands::record::queue::{Content, Item};

/// Options that leave out a part of a run.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct SelectionArgs {
    /// Record only these topics, such as particles,keyframe,status. The constraints, the triangles, and
    /// the headers of snapshots (/steps) are always recorded
    #[arg(long, value_name = "LIST", value_delimiter = ',', conflicts_with = "exclude",
        value_parser = topic)]
    topics: Vec<Topic>,
    /// Leave these topics out, such as status,events. Files declare it, and programs that need a
    /// topic name it
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = optional_topic)]
    exclude: Vec<Topic>,
    /// Record every N-th snapshot, those with a keyframe, and the last one of each file and before each
    /// pause. Commands and tears between them are recorded, so the file can still be verified
    #[arg(long, value_name = "N", default_value = "1", allow_hyphen_values = true,
        value_parser = period)]
    every: NonZeroU32,
    /// Record the commands, and the particles of the first step and then about every ten seconds.
    /// `recorder simulate` computes the others, bit for bit
    #[arg(long, conflicts_with_all = ["topics", "every"])]
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
        let (topics, exclude) = (Vec::new(), Vec::new());
        let every = NonZeroU32::MIN;
        Self { topics, exclude, every, only_commands: false, forces: false, energy: false }
    }
}

impl SelectionArgs {
    pub(crate) fn selection(&self) -> ContentSelection {
        let is_left_out = |topic: &Topic| {
            self.exclude.contains(topic) || !self.topics.is_empty() && !self.topics.contains(topic)
        };
        let left_out: Vec<_> = ContentSelection::OPTIONAL.into_iter().filter(is_left_out).collect();
        let selection = ContentSelection::new(self.every, &left_out);
        let selection = if self.only_commands { selection.with_only_commands() } else { selection };
        let selection = if self.energy { selection.with_energy() } else { selection };
        if self.forces || self.topics.contains(&Topic::Forces) {
            selection.with_forces()
        } else {
            selection
        }
    }

    /// Returns a topic that is left out although the commands are useless without it.
    pub(crate) fn needed_topic(&self) -> Option<Topic> {
        let is_left_out = |topic: &Topic| self.exclude.contains(topic);
        let is_used = |_: &Topic| self.only_commands;
        ContentSelection::FOR_STATES.into_iter().find(is_left_out).filter(is_used)
    }
}

fn topic(text: &str) -> Result<Topic, String> {
    let name = format!("/{}", text.trim().trim_start_matches('/'));
    Topic::from_name(&name).ok_or_else(|| {
        let names = Topic::ALL.map(|topic| &topic.name()[1..]);
        let guess = did_you_mean(&name[1..], names);
        format!("it must be topics of a recording: {}{guess}", names.join(", "))
    })
}

fn optional_topic(text: &str) -> Result<Topic, String> {
    let topic = topic(text)?;
    if ContentSelection::OPTIONAL.contains(&topic) {
        return Ok(topic);
    }
    if topic == Topic::Forces {
        return Err("only a recording with --forces has it".to_owned());
    }
    let names: Vec<_> = ContentSelection::OPTIONAL.map(|topic| &topic.name()[1..]).into();
    Err(format!("every reader needs it (allowed: {})", names.join(", ")))
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
            counts: AllCounts::default(),
        }
    }

    /// Returns the part of an item that is recorded.
    pub(super) fn select(&mut self, item: Item) -> Option<Item> {
        let Item { content, log_time_ns } = item;
        let content = self.selected_part(content, log_time_ns)?;
        Some(Item { content, log_time_ns })
    }

    fn selected_part(&mut self, content: Content, log_time_ns: u64) -> Option<Content> {
        match content {
            Content::Update(message) => {
                match &message {
                    Message::Keyframe { step, .. } => self.keyframe_step = Some(*step),
                    Message::Outcome(row) if row.puts_state_in_place() && row.is_applied() => {
                        self.in_place_step = Some(row.step);
                    }
                    _ => {}
                }
                self.has(message.topic()).then_some(Content::Update(message))
            }
            Content::Snapshot(row, particles) => {
                let is_due = row.snapshot_index.is_none_or(|one| self.selection.has_snapshot(one));
                let has_keyframe = self.keyframe_step == Some(row.step);
                if !is_due && !has_keyframe {
                    self.count_snapshots(|left_out| left_out + 1);
                    self.last_left_out = Some((row, particles, log_time_ns));
                    return None;
                }
                self.last_left_out = None;
                Some(self.recorded_part(row, particles))
            }
        }
    }

    /// Returns what is recorded of the newest snapshot at the end of a file, if it was left out: a file ends
    /// where the recording did, not up to a period before. Messages of the next step may precede it in the file.
    pub(super) fn take_last_snapshot(&mut self) -> Option<Item> {
        let (row, particles, log_time_ns) = self.last_left_out.take()?;
        self.count_snapshots(|left_out| left_out - 1);
        Some(Item { content: self.recorded_part(row, particles), log_time_ns })
    }

    fn count_snapshots(&mut self, count: impl Fn(u64) -> u64) {
        for topic in [Topic::Steps, Topic::Particles] {
            self.counts[topic].left_out = count(self.counts[topic].left_out);
        }
    }

    /// Returns what is recorded of a snapshot: all of it, or its header.
    fn recorded_part(&mut self, row: StepRow, particles: ParticleBuffer) -> Content {
        if self.selection.is_only_commands() && !self.is_state(row.step) {
            self.counts[Topic::Particles].left_out += 1;
            Content::Update(Message::Step(row))
        } else if self.has(Topic::Particles) {
            Content::Snapshot(row, particles)
        } else {
            Content::Update(Message::Step(row))
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

    /// Returns `true` for a selected topic, and counts a message of any other.
    fn has(&mut self, topic: Topic) -> bool {
        let has_topic = self.selection.has_topic(topic);
        self.counts[topic].left_out += u64::from(!has_topic);
        has_topic
    }

    /// Returns the counts of a file, and begins with those of the next one.
    pub(super) fn take_counts(&mut self) -> AllCounts {
        self.keyframes_since_state = None;
        self.last_left_out = None;
        std::mem::take(&mut self.counts)
    }
}

#[cfg(test)]
mod tests {
    use recorder::{OutcomeRow, ParticleBuffer, StepRow};
    use sim_contract::{Action, Command, Outcome, Reason};

    use super::*;

    fn snapshot(index: u32) -> Content {
        let step = u64::from(index);
        let row = StepRow { step, snapshot_index: Some(index), ..StepRow::default() };
        Content::Snapshot(row, ParticleBuffer::default())
    }

    fn keyframe(step: u64) -> Content {
        Content::Update(Message::Keyframe { step, bytes: Vec::new() })
    }

    /// Selects a content that arrives when its step ends.
    fn select(selector: &mut Selector, content: Content) -> Option<Content> {
        let log_time_ns = match &content {
            Content::Snapshot(row, _) => row.step,
            Content::Update(message) => message.step(),
        };
        selector.select(Item { content, log_time_ns }).map(|item| item.content)
    }

    /// Step of a snapshot, which was received when the step ended.
    fn step_of(item: Option<Item>) -> Option<u64> {
        let Item { content, log_time_ns } = item?;
        let step = content.snapshot_step().unwrap();
        assert_eq!(log_time_ns, step);
        Some(step)
    }

    #[test]
    fn snapshots_of_the_period_and_those_with_a_keyframe_are_selected() {
        let every = NonZeroU32::new(4).unwrap();
        let mut selector = Selector::new(ContentSelection::new(every, &[Topic::Keyframe]));
        assert_eq!(select(&mut selector, keyframe(3)), None);
        let selected: Vec<_> =
            (0..10).filter(|one| select(&mut selector, snapshot(*one)).is_some()).collect();
        assert_eq!(selected, [0, 3, 4, 8]);
        assert_eq!(step_of(selector.take_last_snapshot()), Some(9));
        assert_eq!(selector.take_last_snapshot(), None);
        let counts = selector.take_counts();
        assert_eq!((counts[Topic::Particles].left_out, counts[Topic::Steps].left_out), (5, 5));
        assert_eq!(counts[Topic::Keyframe].left_out, 1);
        assert_eq!(selector.take_counts(), AllCounts::default());
    }

    #[test]
    fn a_file_ends_with_its_last_snapshot_although_messages_of_the_next_step_come_before_it() {
        let mut selector = Selector::new(ContentSelection::new(NonZeroU32::new(4).unwrap(), &[]));
        for index in 0..=8 {
            select(&mut selector, snapshot(index));
        }
        assert_eq!(selector.take_last_snapshot(), None, "the last one was selected");
        select(&mut selector, snapshot(9));
        select(&mut selector, keyframe(10));
        assert_eq!(step_of(selector.take_last_snapshot()), Some(9));
        assert_eq!(selector.take_last_snapshot(), None, "it is taken once");
        select(&mut selector, snapshot(11));
        selector.take_counts();
        assert_eq!(selector.take_last_snapshot(), None, "it belongs to the file before");
    }

    #[test]
    fn a_recording_of_commands_has_the_particles_of_the_first_state_and_of_those_put_in_place() {
        let selection = ContentSelection::default().with_only_commands();
        let mut selector = Selector::new(selection);
        let states = |selector: &mut Selector, steps: std::ops::Range<u32>| {
            let is_state = |step: &u32| {
                select(selector, keyframe(u64::from(*step)));
                matches!(select(selector, snapshot(*step)), Some(Content::Snapshot(..)))
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

    #[test]
    fn without_particles_the_header_of_a_snapshot_stays() {
        let mut selector =
            Selector::new(ContentSelection::new(NonZeroU32::MIN, &[Topic::Particles]));
        let selected = select(&mut selector, snapshot(5)).unwrap();
        assert!(matches!(selected, Content::Update(Message::Step(StepRow { step: 5, .. }))));
    }

    #[test]
    fn topics_that_readers_need_cannot_be_left_out() {
        assert_eq!((topic("/status"), topic("steps")), (Ok(Topic::Status), Ok(Topic::Steps)));
        assert!(topic("stats").unwrap_err().contains("particles"));
        assert!(topic("partcles").unwrap_err().ends_with(" (did you mean 'particles'?)"));
        assert!(optional_topic("steps").unwrap_err().starts_with("every reader needs it"));
        let args =
            SelectionArgs { topics: vec![Topic::Status, Topic::Tf], ..SelectionArgs::default() };
        let selection = args.selection();
        let selected = Topic::ALL.into_iter().filter(|topic| selection.has_topic(*topic));
        let expected = [Topic::Tf, Topic::Topology, Topic::Surface, Topic::Status, Topic::Steps];
        assert_eq!(selected.collect::<Vec<_>>(), expected);
    }
}
