//! The messages of the service `tears`, and the list of torn constraints that they carry.

use bytemuck::{Pod, Zeroable};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use sim_types::TearCause;

/// Header of `tears`: 32 bytes, alignment 8. The payload lists every torn constraint,
/// in the order of tearing. A list repeats the lists before it, so a reader that
/// misses a message loses nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.TearsHeader")]
pub struct TearsHeader {
    /// Same as in [`crate::SnapshotHeader`].
    pub run_id: u64,
    /// Step of the newest tear, or of the load, reset, rewind or restore that replaced the list.
    pub step: u64,
    /// Step of the load, reset, rewind or restore that the list begins with. Lists with the same `since_step`
    /// continue each other.
    pub since_step: u64,
    /// Number of constraints at the end of the payload that tore in this step.
    pub new_count: u32,
    /// Length of the payload.
    pub count: u32,
}

const _: () = assert!(size_of::<TearsHeader>() == 32 && align_of::<TearsHeader>() == 8);

/// A torn constraint: 8 bytes, alignment 4; an element of `tears`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("catenary.TornConstraint")]
pub struct TornConstraint {
    /// Index of the constraint.
    pub constraint: u32,
    /// A [`TearCause`] as a number; `u32::MAX` where the cause is unknown, as in the replay of an
    /// old recording.
    pub cause: u32,
}

const _: () = assert!(size_of::<TornConstraint>() == 8 && align_of::<TornConstraint>() == 4);

impl TornConstraint {
    /// Creates an element for a constraint and the cause of its tear; `None` is an unknown cause.
    pub fn new(constraint: u32, cause: Option<TearCause>) -> Self {
        Self { constraint, cause: cause.map_or(u32::MAX, |cause| cause as u32) }
    }

    /// Returns the cause of the tear, if it is known.
    pub fn cause(&self) -> Option<TearCause> {
        TearCause::from_number(self.cause)
    }
}

/// The torn constraints of a state. Empty if nothing tore.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Torn {
    /// Header of the list: the step of the newest tear, and the number of tears in that step.
    pub header: TearsHeader,
    /// The `header.count` constraints, in the order of tearing.
    pub constraints: Vec<TornConstraint>,
}

impl Torn {
    /// Returns the indices of the constraints, in the order of tearing.
    pub fn indices(&self) -> impl Iterator<Item = u32> {
        self.constraints.iter().map(|torn| torn.constraint)
    }

    /// Empties the list at a reset in `step`.
    pub fn reset(&mut self, step: u64) {
        self.constraints.clear();
        let TearsHeader { run_id, .. } = self.header;
        self.header = TearsHeader { run_id, step, since_step: step, new_count: 0, count: 0 };
    }

    /// Adds the constraints that tore in `step`.
    pub fn extend(&mut self, step: u64, new: impl IntoIterator<Item = TornConstraint>) {
        let old_count = self.constraints.len();
        self.constraints.extend(new);
        self.header.step = step;
        self.header.new_count = to_count(self.constraints.len() - old_count);
        self.header.count = to_count(self.constraints.len());
    }

    /// Keeps the first `count` constraints.
    pub fn truncate(&mut self, count: u32) {
        self.constraints.truncate(count as usize);
        self.header.count = to_count(self.constraints.len());
        self.header.new_count = self.header.new_count.min(self.header.count);
    }

    /// Replaces the list by a later one. Returns the constraints that the old list lacks.
    pub fn replace(&mut self, header: TearsHeader, list: &[TornConstraint]) -> Vec<TornConstraint> {
        let (old, new) = (&self.header, &header);
        let is_continuation = (old.run_id, old.since_step) == (new.run_id, new.since_step);
        let known_count = if is_continuation { self.constraints.len().min(list.len()) } else { 0 };
        self.header = header;
        self.constraints.clear();
        self.constraints.extend_from_slice(list);
        list[known_count..].to_vec()
    }
}

/// Collects constraints that tore before step 0, in the order of tearing.
impl FromIterator<TornConstraint> for Torn {
    fn from_iter<T: IntoIterator<Item = TornConstraint>>(constraints: T) -> Self {
        let mut torn = Self::default();
        torn.extend(0, constraints);
        torn.header.new_count = 0;
        torn
    }
}

fn to_count(len: usize) -> u32 {
    u32::try_from(len).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn torn(indices: &[u32]) -> Vec<TornConstraint> {
        indices.iter().map(|index| TornConstraint::new(*index, None)).collect()
    }

    #[test]
    fn a_list_grows_by_steps_and_a_reset_empties_it() {
        let mut list: Torn = torn(&[7, 2]).into_iter().collect();
        let before = TearsHeader { count: 2, ..TearsHeader::default() };
        assert_eq!(list.header, before);
        list.extend(5, torn(&[4]));
        let header = TearsHeader { step: 5, new_count: 1, count: 3, ..TearsHeader::default() };
        assert_eq!((list.header, list.constraints.as_slice()), (header, &torn(&[7, 2, 4])[..]));
        list.truncate(2);
        assert_eq!((list.header.count, list.indices().collect::<Vec<_>>()), (2, vec![7, 2]));
        list.reset(8);
        let empty = TearsHeader { step: 8, since_step: 8, ..TearsHeader::default() };
        assert_eq!((list.header, list.constraints.len()), (empty, 0));
    }

    #[test]
    fn a_later_list_continues_the_same_load_or_replaces_another() {
        let header = |step, since_step| TearsHeader { step, since_step, ..TearsHeader::default() };
        let mut list = Torn::default();
        assert_eq!(list.replace(header(3, 0), &torn(&[7])), torn(&[7]));
        assert_eq!(list.replace(header(5, 0), &torn(&[7, 2])), torn(&[2]));
        assert_eq!(list.replace(header(9, 8), &torn(&[7, 2])), torn(&[7, 2]), "after a reset");
        let other_run = TearsHeader { run_id: 1, ..header(9, 8) };
        assert_eq!(list.replace(other_run, &torn(&[7])), torn(&[7]), "another run");
    }
}
