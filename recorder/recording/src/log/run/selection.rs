//! The part of a run that a recording holds, so that no reader takes the rest for a loss.

use std::collections::BTreeMap;
use std::num::NonZeroU32;

use crate::log::read_error::ReadError;
use crate::log::topic::Topic;

/// Name of the metadata record of [`ContentSelection`].
pub(in crate::log) const SELECTION_METADATA: &str = "selection";
/// Key of the period of snapshots.
const EVERY: &str = "every";

/// The snapshots and additions of a recording: metadata `selection`, before the metadata `run`. The default
/// is every snapshot without forces and energy; such a file has no such record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ContentSelection {
    /// Of the snapshots, every n-th is recorded, those with a keyframe, and the last one of each file and before
    /// each pause.
    pub every: NonZeroU32,
    /// Most snapshots lack their particles, which follow from an earlier state and the commands.
    pub is_only_commands: bool,
    /// The recording has the forces of each step.
    pub has_forces: bool,
    /// The rows in /steps have the energy of their states.
    pub has_energy: bool,
}

impl Default for ContentSelection {
    fn default() -> Self {
        Self {
            every: NonZeroU32::MIN,
            is_only_commands: false,
            has_forces: false,
            has_energy: false,
        }
    }
}

impl ContentSelection {
    /// Returns `true` for a topic of the recording.
    pub fn has_topic(&self, topic: Topic) -> bool {
        topic != Topic::Forces || self.has_forces
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

    /// Checks that each snapshot has its particles.
    ///
    /// # Errors
    /// If some do not; `purpose` needs them.
    pub fn require_all_particles(&self, purpose: &'static str) -> Result<(), ReadError> {
        if self.is_only_commands { Err(ReadError::OnlyCommands { purpose }) } else { Ok(()) }
    }

    /// Returns the entries that are either absent or "true".
    fn flags(&mut self) -> [(&'static str, &mut bool); 3] {
        [
            ("only_commands", &mut self.is_only_commands),
            ("forces", &mut self.has_forces),
            ("energy", &mut self.has_energy),
        ]
    }

    pub(in crate::log) fn to_map(mut self) -> BTreeMap<String, String> {
        let every = (EVERY.to_owned(), self.every.to_string());
        let set = self.flags().into_iter().filter(|(_, is_set)| **is_set);
        set.map(|(key, _)| (key.to_owned(), true.to_string())).chain([every]).collect()
    }

    /// Reads the metadata record.
    pub(in crate::log) fn read(map: &BTreeMap<String, String>) -> Result<Self, ReadError> {
        Self::from_map(map).ok_or(ReadError::BadSelection)
    }

    /// Parses the output of [`ContentSelection::to_map`]. `None` for anything else.
    fn from_map(map: &BTreeMap<String, String>) -> Option<Self> {
        let mut selection = Self { every: map.get(EVERY)?.parse().ok()?, ..Self::default() };
        for (key, is_set) in selection.flags() {
            *is_set =
                map.get(key).map_or(Some(false), |value| (value == "true").then_some(true))?;
        }
        Some(selection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every(count: u32) -> ContentSelection {
        ContentSelection { every: NonZeroU32::new(count).unwrap(), ..ContentSelection::default() }
    }

    #[test]
    fn a_selection_survives_a_round_trip_and_refuses_what_no_recorder_writes() {
        for selection in [
            ContentSelection::default(),
            every(7),
            ContentSelection { is_only_commands: true, ..every(1) },
            ContentSelection { has_forces: true, ..every(7) },
            ContentSelection { has_energy: true, ..every(7) },
        ] {
            assert_eq!(ContentSelection::from_map(&selection.to_map()), Some(selection));
        }
        for (key, value) in [
            ("every", "0"),
            ("every", "x"),
            ("only_commands", "no"),
            ("forces", "no"),
            ("energy", "no"),
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
}
