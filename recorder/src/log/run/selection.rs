//! The part of a run that a recording leaves out on purpose, so that no reader takes it for a loss.

use std::collections::BTreeMap;
use std::num::NonZeroU32;

use crate::log::read::read_error::ReadError;
use crate::log::topic::Topic;

/// Name of the metadata record of [`ContentSelection`].
pub(in crate::log) const SELECTION_METADATA: &str = "selection";
/// Key of the period of snapshots.
const EVERY: &str = "every";
/// Key of the topics that are left out.
const LEFT_OUT: &str = "left_out";
/// Key of a recording of commands. Only such a recording has it.
const ONLY_COMMANDS: &str = "only_commands";
/// Key of a recording of forces. Only such a recording has it.
const FORCES: &str = "forces";
/// Key of a recording of the energy of each state. Only such a recording has it.
const ENERGY: &str = "energy";

/// The topics and snapshots of a recording: metadata `selection`, before the metadata `run`. The default
/// is everything but forces and energy, which are recorded only on request, and such a file has no such record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContentSelection {
    every: NonZeroU32,
    /// In the order of [`Topic::ALL`].
    left_out: [bool; Topic::ALL.len()],
    is_only_commands: bool,
    has_energy: bool,
}

impl Default for ContentSelection {
    fn default() -> Self {
        let mut left_out = [false; Topic::ALL.len()];
        left_out[Topic::Forces.index()] = true;
        Self { every: NonZeroU32::MIN, left_out, is_only_commands: false, has_energy: false }
    }
}

impl ContentSelection {
    /// The topics that a recording may leave out. The others are needed to read it at all.
    pub const OPTIONAL: [Topic; 8] = [
        Topic::Colliders,
        Topic::Tears,
        Topic::Parameters,
        Topic::Keyframe,
        Topic::Outcomes,
        Topic::Status,
        Topic::Events,
        Topic::Particles,
    ];

    /// The topics that a picture of any step needs.
    pub const FOR_PICTURES: [Topic; 3] = [Topic::Colliders, Topic::Tears, Topic::Particles];
    /// The topics that the energy of any step needs.
    pub const FOR_ENERGY: [Topic; 3] = [Topic::Tears, Topic::Parameters, Topic::Particles];
    /// The topics that a proof, a replay and a restored state need.
    pub const FOR_STATES: [Topic; 6] = [
        Topic::Colliders,
        Topic::Tears,
        Topic::Parameters,
        Topic::Keyframe,
        Topic::Outcomes,
        Topic::Particles,
    ];

    /// Leaves out topics of [`ContentSelection::OPTIONAL`]. Of the snapshots, keeps every n-th, those with a keyframe,
    /// and the last one of each file and before each pause.
    ///
    /// # Panics
    /// If another topic is left out.
    pub fn new(every: NonZeroU32, left_out: &[Topic]) -> Self {
        let mut selection = Self { every, ..Self::default() };
        for topic in left_out {
            assert!(Self::OPTIONAL.contains(topic), "{} cannot be left out", topic.name());
            selection.left_out[topic.index()] = true;
        }
        selection
    }

    /// Leaves out the particles of most snapshots, which follow from an earlier state and the commands.
    #[must_use]
    pub fn with_only_commands(self) -> Self {
        Self { is_only_commands: true, ..self }
    }

    /// Adds the forces.
    #[must_use]
    pub fn with_forces(mut self) -> Self {
        self.left_out[Topic::Forces.index()] = false;
        self
    }

    /// Adds the energy of each state to its row in /steps.
    #[must_use]
    pub fn with_energy(self) -> Self {
        Self { has_energy: true, ..self }
    }

    /// Returns `true` if the rows in /steps have the energy of their states.
    pub fn has_energy(&self) -> bool {
        self.has_energy
    }

    /// Returns the selection of the same recording with the particles of all its snapshots.
    #[must_use]
    pub fn with_all_particles(self) -> Self {
        Self { is_only_commands: false, ..self }
    }

    /// Returns `true` if only some snapshots have particles.
    pub fn is_only_commands(&self) -> bool {
        self.is_only_commands
    }

    /// Returns `true` if nothing is left out, and nothing is recorded on request.
    pub fn is_everything(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the topics that the recording leaves out. Forces are not among them: a recording has them on
    /// request.
    pub fn left_out(&self) -> impl Iterator<Item = Topic> {
        Self::OPTIONAL.into_iter().filter(|topic| !self.has_topic(*topic))
    }

    /// Returns the topics that a recorder declares in a file, those that it leaves out too, but forces only with
    /// their rows.
    pub(in crate::log) fn declared(self) -> impl Iterator<Item = Topic> {
        let is_declared = move |topic: &Topic| *topic != Topic::Forces || self.has_topic(*topic);
        Topic::ALL.into_iter().filter(is_declared)
    }

    /// Returns `true` for a topic of the recording.
    pub fn has_topic(&self, topic: Topic) -> bool {
        !self.left_out[topic.index()]
    }

    /// Returns `true` if a snapshot with this number is always recorded. Others are recorded with a keyframe, and as
    /// the last one of a file or before a pause.
    pub fn has_snapshot(&self, index: u32) -> bool {
        index.is_multiple_of(self.every.get())
    }

    /// Returns how many snapshots between two recorded ones should be in the file and are not. Numbers
    /// count modulo 2^32; none is missing before one that goes back, because the file has it twice.
    pub fn missing_between(&self, last_index: u32, index: u32) -> u64 {
        if index.wrapping_sub(last_index).cast_signed() <= 0 {
            return 0;
        }
        let every = u64::from(self.every.get());
        let last = u64::from(last_index);
        let next = last + u64::from(index.wrapping_sub(last_index));
        // Multiples of `every` between the two, without them.
        next.saturating_sub(1).max(last) / every - last / every
    }

    /// Checks that a recording has topics.
    ///
    /// # Errors
    /// If it leaves some of them out; `purpose` needs them.
    pub fn require(&self, topics: &[Topic], purpose: &'static str) -> Result<(), ReadError> {
        let missing = topics.iter().filter(|topic| !self.has_topic(**topic));
        let missing: Vec<_> = missing.map(|topic| topic.name()).collect();
        if missing.is_empty() {
            return Ok(());
        }
        Err(ReadError::LeftOut { topics: missing.join(", "), purpose })
    }

    /// Checks that each snapshot has its particles.
    ///
    /// # Errors
    /// If some do not; `purpose` needs them.
    pub fn require_all_particles(&self, purpose: &'static str) -> Result<(), ReadError> {
        if self.is_only_commands { Err(ReadError::OnlyCommands { purpose }) } else { Ok(()) }
    }

    pub(in crate::log) fn to_map(self) -> BTreeMap<String, String> {
        let left_out: Vec<_> = self.left_out().map(Topic::name).collect();
        let mut map = BTreeMap::from([
            (EVERY.to_owned(), self.every.to_string()),
            (LEFT_OUT.to_owned(), left_out.join(" ")),
        ]);
        if self.is_only_commands {
            map.insert(ONLY_COMMANDS.to_owned(), true.to_string());
        }
        if self.has_topic(Topic::Forces) {
            map.insert(FORCES.to_owned(), true.to_string());
        }
        if self.has_energy {
            map.insert(ENERGY.to_owned(), true.to_string());
        }
        map
    }

    /// Reads the metadata record.
    pub(in crate::log) fn read(map: &BTreeMap<String, String>) -> Result<Self, ReadError> {
        Self::from_map(map).ok_or(ReadError::BadSelection)
    }

    /// Parses the output of [`ContentSelection::to_map`]. `None` for anything else.
    fn from_map(map: &BTreeMap<String, String>) -> Option<Self> {
        let every = map.get(EVERY)?.parse().ok()?;
        let topics = map.get(LEFT_OUT)?.split(' ').filter(|name| !name.is_empty());
        let topics = topics
            .map(|name| Topic::from_name(name).filter(|topic| Self::OPTIONAL.contains(topic)));
        let selection = Self::new(every, &topics.collect::<Option<Vec<_>>>()?);
        let selection =
            if is_set(map, ONLY_COMMANDS)? { selection.with_only_commands() } else { selection };
        let selection = if is_set(map, FORCES)? { selection.with_forces() } else { selection };
        Some(if is_set(map, ENERGY)? { selection.with_energy() } else { selection })
    }
}

/// Returns `true` for a key with the value "true"; `None` for any other value.
fn is_set(map: &BTreeMap<String, String>, key: &str) -> Option<bool> {
    map.get(key).map_or(Some(false), |value| (value == "true").then_some(true))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every(count: u32) -> ContentSelection {
        ContentSelection::new(NonZeroU32::new(count).unwrap(), &[Topic::Status, Topic::Keyframe])
    }

    #[test]
    fn a_selection_survives_a_round_trip_and_refuses_what_no_recorder_writes() {
        for selection in [
            ContentSelection::default(),
            every(7),
            every(1).with_only_commands(),
            every(7).with_forces(),
            every(7).with_energy(),
        ] {
            assert_eq!(ContentSelection::from_map(&selection.to_map()), Some(selection));
        }
        for (key, value) in [
            ("every", "0"),
            ("every", "x"),
            ("left_out", "/steps"),
            ("left_out", "?"),
            ("only_commands", "no"),
            ("forces", "no"),
            ("energy", "no"),
            ("left_out", "/forces"),
        ] {
            let mut map = every(2).to_map();
            map.insert(key.to_owned(), value.to_owned());
            assert_eq!(ContentSelection::from_map(&map), None, "{key}={value}");
        }
    }

    #[test]
    fn only_snapshots_of_the_period_are_missing() {
        let missing = |count, last, index| every(count).missing_between(last, index);
        assert_eq!((missing(1, 4, 5), missing(1, 4, 8), missing(1, u32::MAX, 2)), (0, 3, 2));
        assert_eq!((missing(10, 0, 10), missing(10, 0, 30), missing(10, 7, 9)), (0, 2, 0));
        assert_eq!((missing(10, 7, 11), missing(10, 7, 20)), (1, 1));
    }

    #[test]
    fn a_missing_topic_is_named_with_its_use() {
        let error = every(1)
            .require(&[Topic::Keyframe, Topic::Particles], "`recorder verify`")
            .unwrap_err();
        let expected = "leaves out /keyframe on purpose (--topics or --exclude of its recorder), which \
            `recorder verify` needs";
        assert_eq!(error.to_string(), expected);
    }
}
