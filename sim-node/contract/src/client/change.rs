//! Changes between two states, and the changes that wait for their state.

use std::collections::VecDeque;

use sim_messages::{
    ColliderState, CollidersHeader, ForceRow, ForcesHeader, KeyframeHeader, Outcome,
    ParameterValues, ParametersHeader, SnapshotHeader, TearsHeader, TornConstraint,
};

use crate::client::views::Parameters;

/// A change between two states.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The state is the first of another load.
    Load,
    /// The colliders at the end of a step.
    Colliders(CollidersHeader, Vec<ColliderState>),
    /// New tears, or a reset. The list holds only the tears that no earlier state contains;
    /// `header.count` counts all torn constraints.
    Tears(TearsHeader, Vec<TornConstraint>),
    /// The parameters from a step on.
    Parameters(ParametersHeader, ParameterValues),
    /// The impulses of a step. Only for a tap that reads them.
    Forces(ForcesHeader, Vec<ForceRow>),
    /// The keyframe of a step.
    Keyframe(KeyframeHeader, Vec<u8>),
    /// The outcome of a command. Commands that control a replay are left out.
    Outcome(Outcome),
}

impl Change {
    /// Rank in the order of publication within a step.
    fn publication_rank(&self) -> u32 {
        match self {
            Self::Load => 0,
            Self::Colliders(..) => 1,
            Self::Tears(..) => 2,
            Self::Parameters(..) => 3,
            Self::Forces(..) => 4,
            Self::Keyframe(..) => 5,
            Self::Outcome(_) => 6,
        }
    }
}

/// Numbers of changes that were dropped because their state did not arrive.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LostChanges {
    /// Lists of colliders.
    pub colliders: u64,
    /// Lists of tears. Every later list contains them.
    pub tears: u64,
    /// Values of the parameters.
    pub parameters: u64,
    /// Impulses of steps.
    pub forces: u64,
    /// Keyframes.
    pub keyframes: u64,
    /// Outcomes.
    pub outcomes: u64,
}

impl LostChanges {
    fn add(&mut self, change: &Change) {
        match change {
            Change::Load => {}
            Change::Colliders(..) => self.colliders += 1,
            Change::Tears(..) => self.tears += 1,
            Change::Parameters(..) => self.parameters += 1,
            Change::Forces(..) => self.forces += 1,
            Change::Keyframe(..) => self.keyframes += 1,
            Change::Outcome(_) => self.outcomes += 1,
        }
    }
}

/// Most pending changes. Between two snapshots, a node that publishes every 1,000th step can move
/// its colliders 1,000 times.
const PENDING_MAX: usize = 4096;

/// The changes that wait for a state of their step or a later step. At the limit, the oldest change
/// is dropped and counted.
#[derive(Debug, Default)]
pub(crate) struct PendingChanges {
    queue: VecDeque<PendingChange>,
    lost: LostChanges,
}

#[derive(Debug)]
struct PendingChange {
    run_id: u64,
    step: u64,
    change: Change,
}

impl PendingChanges {
    pub(crate) fn push(&mut self, run_id: u64, step: u64, change: Change) {
        if self.queue.len() == PENDING_MAX
            && let Some(oldest) = self.queue.pop_front()
        {
            self.lost.add(&oldest.change);
        }
        self.queue.push_back(PendingChange { run_id, step, change });
    }

    /// Numbers of dropped changes.
    pub(crate) fn lost(&self) -> LostChanges {
        self.lost
    }

    /// Removes the changes up to a snapshot. Returns them in the order of publication.
    pub(crate) fn drain_due(&mut self, header: &SnapshotHeader) -> Vec<Change> {
        let is_due = |pending: &PendingChange| {
            pending.run_id == header.run_id && pending.step <= header.step
        };
        let (due, rest): (VecDeque<_>, _) = self.queue.drain(..).partition(is_due);
        self.queue = rest;
        let mut due = Vec::from(due);
        due.sort_by_key(|pending| (pending.step, pending.change.publication_rank()));
        due.into_iter().map(|pending| pending.change).collect()
    }

    /// Drops all changes of a run.
    pub(crate) fn drop_run(&mut self, run_id: u64) {
        self.queue.retain(|pending| pending.run_id != run_id);
    }

    /// Returns the first pending parameters of a run.
    pub(crate) fn parameters(&self, run_id: u64) -> Option<Parameters> {
        self.changes(run_id).find_map(|change| match change {
            Change::Parameters(header, values) => {
                Some(Parameters { header: *header, values: values.clone() })
            }
            _ => None,
        })
    }

    /// Returns the first pending list of tears that begins with the list of a snapshot.
    pub(crate) fn tears(
        &self,
        snapshot: &SnapshotHeader,
    ) -> Option<(&TearsHeader, &[TornConstraint])> {
        self.changes(snapshot.run_id).find_map(|change| match change {
            Change::Tears(header, list)
                if header.since_step <= snapshot.step
                    && list.len() >= snapshot.torn_count as usize =>
            {
                Some((header, list.as_slice()))
            }
            _ => None,
        })
    }

    fn changes(&self, run_id: u64) -> impl Iterator<Item = &Change> {
        let pending = self.queue.iter().filter(move |pending| pending.run_id == run_id);
        pending.map(|pending| &pending.change)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(run_id: u64) -> SnapshotHeader {
        SnapshotHeader { run_id, step: 100, ..SnapshotHeader::default() }
    }

    fn outcome(index: u64) -> Change {
        Change::Outcome(Outcome { index, ..Outcome::default() })
    }

    #[test]
    fn pending_changes_beyond_the_limit_are_dropped_and_counted() {
        let mut pending = PendingChanges::default();
        for index in 0..PENDING_MAX as u64 + 3 {
            pending.push(7, 100, outcome(index));
        }
        assert_eq!(pending.lost(), LostChanges { outcomes: 3, ..LostChanges::default() });
        assert_eq!(pending.drain_due(&snapshot(7))[0], outcome(3));
    }

    #[test]
    fn dropping_one_run_keeps_the_changes_of_another() {
        let mut pending = PendingChanges::default();
        pending.push(7, 1, outcome(0));
        pending.push(8, 1, outcome(1));
        pending.drop_run(7);
        assert_eq!(pending.drain_due(&snapshot(7)), []);
        assert_eq!(pending.drain_due(&snapshot(8)), [outcome(1)]);
    }
}
