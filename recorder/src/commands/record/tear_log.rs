//! From the lists of all that tore, as a node publishes them, to what is new in each.
//!
//! Each list repeats the ones before it, so one that was missed loses nothing: what it said comes
//! with the next one, and is written with the step of that. Only a reset starts a list anew, and
//! only its outcome tells for sure: after it, the same constraints may tear in the same order. An
//! outcome is published after the list of its step. So lists wait for a snapshot of their step, or
//! of a later one, by which all of the step has been seen.

use std::collections::{BTreeSet, VecDeque};

use recorder::TearsRow;
use sim_contract::{SnapshotHeader, TearCause, TearsHeader};

/// Most lists that wait, and causes of lists. Of more, the oldest are dropped: a list after them
/// holds the same.
const WAITING_MAX: usize = 64;

/// A payload under its header.
type List<T> = (TearsHeader, Vec<T>);

/// What tore in the run that is recorded.
#[derive(Debug, Default)]
pub(crate) struct TearLog {
    /// In the order of publication.
    lists: VecDeque<List<u32>>,
    causes: VecDeque<List<u8>>,
    /// Steps of the resets that no list has shown yet.
    resets: BTreeSet<u64>,
    /// How many of the newest list have been told of, and its step.
    known_count: usize,
    known_step: u64,
}

impl TearLog {
    /// Takes in what arrived in a batch.
    pub(crate) fn add(&mut self, lists: Vec<List<u32>>, causes: Vec<List<u8>>) {
        self.lists.extend(lists);
        self.causes.extend(causes);
        self.lists.drain(..self.lists.len().saturating_sub(WAITING_MAX));
        self.causes.drain(..self.causes.len().saturating_sub(WAITING_MAX));
    }

    /// Takes in that a reset took effect at a step.
    pub(crate) fn add_reset(&mut self, step: u64) {
        self.resets.insert(step);
    }

    /// Whether what was torn at a snapshot is known. Some list always comes: a load begins with
    /// one, and whoever joins is given the newest.
    pub(crate) fn is_known_at(&self, snapshot: &SnapshotHeader) -> bool {
        self.list_at(snapshot).is_some()
    }

    /// Begins with a snapshot: what was torn before it. What tore in its own step comes as a row.
    pub(crate) fn begin(&mut self, first: &SnapshotHeader) -> Vec<u32> {
        let torn_count = first.torn_count as usize;
        let before = self.list_at(first).map_or(Vec::new(), |(header, list)| {
            let is_whole = header.step == first.step && list.len() == torn_count;
            let new_count = if is_whole { header.new_count as usize } else { 0 };
            list[..torn_count.saturating_sub(new_count)].to_vec()
        });
        self.lists.retain(|(header, _)| header.step >= first.step && header.run_id == first.run_id);
        self.causes.retain(|(header, _)| header.run_id == first.run_id);
        (self.known_count, self.known_step) = (before.len(), first.step);
        before
    }

    /// The list that was in force at a snapshot, or a later one that begins with it.
    fn list_at(&self, snapshot: &SnapshotHeader) -> Option<&List<u32>> {
        let is_long = |list: &&List<u32>| {
            list.0.run_id == snapshot.run_id && list.1.len() >= snapshot.torn_count as usize
        };
        let is_later = |list: &&List<u32>| list.0.step > snapshot.step;
        let mut lists = self.lists.iter().filter(is_long);
        let in_force = lists.clone().rfind(|list| !is_later(list));
        in_force.or_else(|| lists.find(is_later))
    }

    /// The rows of the lists up to the newest snapshot.
    pub(crate) fn rows_until(&mut self, newest: &SnapshotHeader) -> Vec<TearsRow> {
        let mut rows = Vec::new();
        while let Some((header, list)) = self.lists.pop_front() {
            if header.run_id != newest.run_id {
                continue;
            }
            if header.step > newest.step {
                self.lists.push_front((header, list));
                break;
            }
            rows.extend(self.row(header, &list));
        }
        self.causes.retain(|(header, _)| header.step > newest.step);
        rows
    }

    fn row(&mut self, header: TearsHeader, list: &[u32]) -> Option<TearsRow> {
        let is_reset = self.has_reset(self.known_step, header.step);
        self.resets = self.resets.split_off(&(header.step + 1));
        // A list never gets shorter otherwise: this is the reset of an outcome that was missed.
        if is_reset || list.len() < self.known_count {
            self.known_count = 0;
        }
        let known_count = std::mem::replace(&mut self.known_count, list.len());
        self.known_step = header.step;
        let constraints = list[known_count..].to_vec();
        let causes = self.causes_of(&header, list.len());
        (!constraints.is_empty()).then(|| TearsRow {
            step: header.step,
            constraints,
            causes: causes.into_iter().skip(known_count).collect(),
        })
    }

    /// Whether a reset took effect after one step, up to another.
    fn has_reset(&self, after: u64, until: u64) -> bool {
        after < until && self.resets.range(after + 1..=until).next().is_some()
    }

    /// The causes of a list: its own, or those of a later list that begins with it. Empty if they
    /// are not known.
    fn causes_of(&self, list: &TearsHeader, count: usize) -> Vec<String> {
        let found = self.causes.iter().find(|(header, causes)| {
            (header.run_id, causes.len() >= count) == (list.run_id, true)
                && header.step >= list.step
                && !self.has_reset(list.step, header.step)
        });
        let Some((_, numbers)) = found else { return Vec::new() };
        let causes: Vec<_> = numbers[..count]
            .iter()
            .map(|number| TearCause::from_number((*number).into()))
            .collect();
        if causes.iter().all(Option::is_none) {
            return Vec::new();
        }
        let name = |cause: Option<TearCause>| cause.map_or("unknown", TearCause::name).to_owned();
        causes.into_iter().map(name).collect()
    }

    /// Constraints that a snapshot counts as torn, and no list has named.
    pub(crate) fn missing_count(&self, newest: &SnapshotHeader) -> u64 {
        (newest.torn_count as usize).saturating_sub(self.known_count) as u64
    }
}

#[cfg(test)]
mod tests;
