//! Published states, each put together from the messages of all services.

use std::collections::VecDeque;

use sim_types::ParameterValues;

use crate::client::views::Parameters;
use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::outcome::{OUTCOME_FLAG_CONTROL, Outcome};
use crate::messages::parameters::ParametersHeader;
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::tears::{TearsHeader, TornConstraint};
use crate::messages::topology::{ConstraintState, KeyframeHeader, LoadHeader, Triangle};
use crate::messages::update::Update;

/// A published state with everything that belongs to it, as of the end of its step.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Header of the snapshot.
    pub header: &'a SnapshotHeader,
    /// The particles, by index, in shared memory.
    pub particles: &'a [ParticleState],
    /// The load that the state belongs to.
    pub load: &'a LoadedScene,
    /// Constraints torn since the load or the last reset, in the order of tearing;
    /// `header.torn_count` of them, unless a message was lost.
    pub torn: &'a [TornConstraint],
    /// The colliders, by index.
    pub colliders: &'a [ColliderState],
    /// The parameters. For the first state after attaching to a paused node, they may be those of
    /// the step after it: their header names the step.
    pub parameters: &'a Parameters,
    /// Everything that changed since the state before, in the order of publication.
    pub changes: &'a [Change],
}

/// A scene with everything that stays the same until the next load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadedScene {
    /// Identity of the load.
    pub header: LoadHeader,
    /// The scene as TOML.
    pub scene: Vec<u8>,
    /// The constraints, by index.
    pub constraints: Vec<ConstraintState>,
    /// The surface; may be empty.
    pub triangles: Vec<Triangle>,
}

/// A change between two states.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The state is the first of another load.
    Load,
    /// The colliders at the end of a step.
    Colliders(CollidersHeader, Vec<ColliderState>),
    /// Tears that no earlier state has shown, or a reset. `header.count` counts all torn
    /// constraints.
    Tears(TearsHeader, Vec<TornConstraint>),
    /// The parameters from a step on.
    Parameters(ParametersHeader, ParameterValues),
    /// The keyframe of a step.
    Keyframe(KeyframeHeader, Vec<u8>),
    /// An outcome. Answers to commands that control a replay are not among the changes.
    Outcome(Outcome),
}

/// Most changes that wait for their state. A node that publishes every 1,000th step moves its
/// colliders in between; beyond the limit the oldest change is dropped and counted.
const WAITING_MAX: usize = 4096;
/// Most loads that wait for their first state.
const LOADS_WAITING_MAX: usize = 4;

/// Puts states together.
#[derive(Debug, Default)]
pub(crate) struct StateAssembler {
    run_id: u64,
    load: Option<LoadedScene>,
    torn: Vec<TornConstraint>,
    /// As in the newest list that was shown.
    since_step: u64,
    colliders: Vec<ColliderState>,
    parameters: Parameters,
    /// Changes since the state before.
    changes: Vec<Change>,
    loads_waiting: VecDeque<PartialLoad>,
    waiting: VecDeque<Waiting>,
    lost_count: u64,
}

/// The parts of a load that have arrived.
#[derive(Debug, Default)]
struct PartialLoad {
    run_id: u64,
    topology_revision: u32,
    scene: Option<Vec<u8>>,
    constraints: Option<(LoadHeader, Vec<ConstraintState>)>,
    triangles: Option<Vec<Triangle>>,
}

/// A change that waits for a state of its step or of a later one.
#[derive(Debug)]
struct Waiting {
    run_id: u64,
    step: u64,
    change: Change,
}

impl StateAssembler {
    /// Keeps a message until its state arrives.
    pub(crate) fn add(&mut self, update: &Update<'_>) {
        match *update {
            Update::Scene(header, text) => {
                self.partial_load(header).scene = Some(text.to_vec());
            }
            Update::Topology(header, constraints) => {
                self.partial_load(header).constraints = Some((*header, constraints.to_vec()));
            }
            Update::Surface(header, triangles) => {
                self.partial_load(header).triangles = Some(triangles.to_vec());
            }
            Update::Colliders(header, list) => {
                let change = Change::Colliders(*header, list.to_vec());
                self.wait(header.run_id, header.step, change);
            }
            Update::Tears(header, list) => {
                let change = Change::Tears(*header, list.to_vec());
                self.wait(header.run_id, header.step, change);
            }
            Update::Parameters(header, values) => {
                self.wait(header.run_id, header.step, Change::Parameters(*header, *values));
            }
            Update::Keyframe(header, bytes) => {
                let change = Change::Keyframe(*header, bytes.to_vec());
                self.wait(header.run_id, header.step, change);
            }
            Update::Outcome(outcome) if outcome.flags & OUTCOME_FLAG_CONTROL == 0 => {
                self.wait(outcome.run_id, outcome.step, Change::Outcome(*outcome));
            }
            Update::Outcome(_) | Update::Status(_) => {}
        }
    }

    fn partial_load(&mut self, header: &LoadHeader) -> &mut PartialLoad {
        let LoadHeader { run_id, topology_revision, .. } = *header;
        let key = (run_id, topology_revision);
        let is_same = |one: &PartialLoad| (one.run_id, one.topology_revision) == key;
        let place = self.loads_waiting.iter().position(is_same).unwrap_or_else(|| {
            if self.loads_waiting.len() == LOADS_WAITING_MAX {
                self.loads_waiting.pop_front();
            }
            let load = PartialLoad { run_id, topology_revision, ..PartialLoad::default() };
            self.loads_waiting.push_back(load);
            self.loads_waiting.len() - 1
        });
        &mut self.loads_waiting[place]
    }

    fn wait(&mut self, run_id: u64, step: u64, change: Change) {
        if self.waiting.len() == WAITING_MAX {
            self.waiting.pop_front();
            self.lost_count += 1;
        }
        self.waiting.push_back(Waiting { run_id, step, change });
    }

    /// Changes that were dropped because their state did not come.
    pub(crate) fn lost_count(&self) -> u64 {
        self.lost_count
    }

    /// Puts together the state of a snapshot. Returns `None` if its load has not arrived, as right
    /// after attaching: then a later snapshot brings everything.
    pub(crate) fn assemble<'a>(
        &'a mut self,
        header: &'a SnapshotHeader,
        particles: &'a [ParticleState],
    ) -> Option<State<'a>> {
        self.changes.clear();
        self.begin_run(header.run_id);
        self.begin_load(header);
        for change in self.due_changes(header) {
            self.apply(change);
        }
        self.complete_torn(header);
        let load = self.load.as_ref().filter(|load| load.is_of(header))?;
        Some(State {
            header,
            particles,
            load,
            torn: &self.torn,
            colliders: &self.colliders,
            parameters: &self.parameters,
            changes: &self.changes,
        })
    }

    /// Changes that no state has shown, in the order of publication.
    pub(crate) fn take_waiting(&mut self) -> Vec<Change> {
        let (run_id, mut rest) = (self.run_id, std::mem::take(&mut self.waiting));
        rest.retain(|waiting| waiting.run_id == run_id);
        rest.into_iter().map(|waiting| waiting.change).collect()
    }

    /// With the first snapshot of another run, what waits of the old one is out of date.
    fn begin_run(&mut self, run_id: u64) {
        if run_id != self.run_id {
            let old = self.run_id;
            self.waiting.retain(|waiting| waiting.run_id != old);
            self.run_id = run_id;
            (self.load, self.since_step) = (None, 0);
            self.torn.clear();
            self.colliders.clear();
            self.parameters = Parameters::default();
        }
    }

    fn begin_load(&mut self, header: &SnapshotHeader) {
        if self.load.as_ref().is_some_and(|load| load.is_of(header)) {
            return;
        }
        let key = (header.run_id, header.topology_revision);
        let place = self
            .loads_waiting
            .iter()
            .position(|one| (one.run_id, one.topology_revision) == key && one.is_complete());
        let Some(place) = place else { return };
        // The loads before it have no more states.
        self.loads_waiting.drain(..place);
        self.load = self.loads_waiting.pop_front().and_then(PartialLoad::complete);
        self.changes.push(Change::Load);
    }

    /// Takes out the changes up to a snapshot, in the order of publication.
    fn due_changes(&mut self, header: &SnapshotHeader) -> Vec<Change> {
        let is_due = |one: &Waiting| one.run_id == header.run_id && one.step <= header.step;
        let (mut due, mut rest) = (Vec::new(), VecDeque::with_capacity(self.waiting.len()));
        for waiting in self.waiting.drain(..) {
            if is_due(&waiting) { due.push(waiting) } else { rest.push_back(waiting) }
        }
        self.waiting = rest;
        due.sort_by_key(|one| (one.step, one.change.place()));
        due.into_iter().map(|one| one.change).collect()
    }

    fn apply(&mut self, change: Change) {
        match &change {
            Change::Colliders(_, list) => self.colliders.clone_from(list),
            Change::Parameters(header, values) => {
                self.parameters = Parameters { header: *header, values: *values };
            }
            Change::Tears(header, list) => {
                let new = self.replace_torn(header, list);
                self.changes.push(Change::Tears(*header, new));
                return;
            }
            Change::Load | Change::Keyframe(..) | Change::Outcome(_) => {}
        }
        self.changes.push(change);
    }

    /// Replaces the list of torn constraints. Returns those that the list before it lacks.
    fn replace_torn(
        &mut self,
        header: &TearsHeader,
        list: &[TornConstraint],
    ) -> Vec<TornConstraint> {
        let continues = header.since_step == self.since_step;
        let known_count = if continues { self.torn.len().min(list.len()) } else { 0 };
        self.since_step = header.since_step;
        self.torn.clear();
        self.torn.extend_from_slice(list);
        list[known_count..].to_vec()
    }

    /// Where the list of a snapshot was overwritten before it was read, a later list begins with it.
    fn complete_torn(&mut self, header: &SnapshotHeader) {
        let count = header.torn_count as usize;
        if self.parameters_are_unknown(header)
            && let Some(parameters) = self.waiting.iter().find_map(|one| one.parameters(header))
        {
            self.parameters = parameters;
        }
        if self.torn.len() == count {
            return;
        }
        let longer = self.waiting.iter().find_map(|one| match &one.change {
            Change::Tears(later, list)
                if one.run_id == header.run_id
                    && later.since_step <= header.step
                    && list.len() >= count =>
            {
                Some((*later, list[..count].to_vec()))
            }
            _ => None,
        });
        if let Some((later, list)) = longer {
            let shown = TearsHeader { step: header.step, count: header.torn_count, ..later };
            let new = self.replace_torn(&shown, &list);
            let new_count = u32::try_from(new.len()).unwrap_or(u32::MAX);
            self.changes.push(Change::Tears(TearsHeader { new_count, ..shown }, new));
        }
    }

    fn parameters_are_unknown(&self, header: &SnapshotHeader) -> bool {
        self.parameters.header.run_id != header.run_id
    }
}

impl LoadedScene {
    /// Returns `true` if a snapshot belongs to this load.
    fn is_of(&self, snapshot: &SnapshotHeader) -> bool {
        (self.header.run_id, self.header.topology_revision)
            == (snapshot.run_id, snapshot.topology_revision)
    }
}

impl Waiting {
    /// The parameters, if the message holds those of a snapshot's run.
    fn parameters(&self, header: &SnapshotHeader) -> Option<Parameters> {
        match &self.change {
            Change::Parameters(own, values) if self.run_id == header.run_id => {
                Some(Parameters { header: *own, values: *values })
            }
            _ => None,
        }
    }
}

impl PartialLoad {
    fn is_complete(&self) -> bool {
        self.scene.is_some() && self.constraints.is_some() && self.triangles.is_some()
    }

    fn complete(self) -> Option<LoadedScene> {
        let (header, constraints) = self.constraints?;
        Some(LoadedScene { header, scene: self.scene?, constraints, triangles: self.triangles? })
    }
}

impl Change {
    /// Place in the order of publication within a step.
    fn place(&self) -> u32 {
        match self {
            Self::Load => 0,
            Self::Colliders(..) => 1,
            Self::Tears(..) => 2,
            Self::Parameters(..) => 3,
            Self::Keyframe(..) => 4,
            Self::Outcome(_) => 5,
        }
    }
}

#[cfg(test)]
mod tests {
    use sim_types::{Action, TearCause};

    use super::*;
    use crate::messages::command::Command;

    const RUN_ID: u64 = 7;

    fn snapshot(step: u64, torn_count: u32) -> SnapshotHeader {
        SnapshotHeader { run_id: RUN_ID, step, torn_count, ..SnapshotHeader::default() }
    }

    fn assembler() -> StateAssembler {
        let mut assembler = StateAssembler::default();
        add_load(&mut assembler, 0);
        add_tears(&mut assembler, (0, 0), &[]);
        assembler
    }

    fn add_load(assembler: &mut StateAssembler, topology_revision: u32) {
        let header = LoadHeader { run_id: RUN_ID, topology_revision, ..LoadHeader::default() };
        assembler.add(&Update::Scene(&header, b"version = 1"));
        assembler.add(&Update::Topology(&header, &[]));
        assembler.add(&Update::Surface(&header, &[]));
    }

    fn add_tears(assembler: &mut StateAssembler, (step, since_step): (u64, u64), torn: &[u32]) {
        let header = TearsHeader {
            run_id: RUN_ID,
            step,
            since_step,
            count: torn.len().try_into().unwrap(),
            ..TearsHeader::default()
        };
        assembler.add(&Update::Tears(&header, &pairs(torn)));
    }

    fn add_damping(assembler: &mut StateAssembler, step: u64, damping: f32) {
        let header = ParametersHeader { run_id: RUN_ID, step, ..ParametersHeader::default() };
        let values = ParameterValues { damping, ..ParameterValues::default() };
        assembler.add(&Update::Parameters(&header, &values));
    }

    fn outcome(index: u64, step: u64) -> Outcome {
        let command = Command::new(1, index, Action::Reset);
        Outcome { run_id: RUN_ID, ..Outcome::new(index, step, command, Ok(())) }
    }

    fn pairs(torn: &[u32]) -> Vec<TornConstraint> {
        torn.iter().map(|index| TornConstraint::new(*index, Some(TearCause::Cut))).collect()
    }

    /// What is torn at a snapshot, and what is new.
    fn torn_at(assembler: &mut StateAssembler, header: &SnapshotHeader) -> (Vec<u32>, Vec<u32>) {
        let indices = |list: &[TornConstraint]| list.iter().map(|one| one.constraint).collect();
        let state = assembler.assemble(header, &[]).unwrap();
        let new = state.changes.iter().filter_map(|change| match change {
            Change::Tears(_, new) => Some(indices(new)),
            _ => None,
        });
        (indices(state.torn), new.flat_map(|list: Vec<u32>| list).collect())
    }

    #[test]
    fn a_change_is_part_of_the_first_state_of_its_step_or_later() {
        let mut assembler = assembler();
        add_damping(&mut assembler, 0, 0.0);
        add_damping(&mut assembler, 3, 3.0);
        assembler.add(&Update::Outcome(&outcome(0, 3)));
        let first = snapshot(2, 0);
        let state = assembler.assemble(&first, &[]).unwrap();
        assert_eq!(state.parameters.values.damping, 0.0);
        assert_eq!(state.changes[0], Change::Load);
        assert!(!state.changes.contains(&Change::Outcome(outcome(0, 3))));
        let second = snapshot(4, 0);
        let state = assembler.assemble(&second, &[]).unwrap();
        assert_eq!((state.parameters.header.step, state.parameters.values.damping), (3, 3.0));
        assert_eq!(state.changes.len(), 2);
        assert_eq!(state.changes[1], Change::Outcome(outcome(0, 3)));
    }

    #[test]
    fn only_new_tears_are_changes_and_a_reset_begins_anew() {
        let mut assembler = assembler();
        add_tears(&mut assembler, (2, 0), &[5]);
        add_tears(&mut assembler, (4, 0), &[5, 1]);
        assert_eq!(torn_at(&mut assembler, &snapshot(1, 0)), (vec![], vec![]));
        assert_eq!(torn_at(&mut assembler, &snapshot(2, 1)), (vec![5], vec![5]));
        assert_eq!(torn_at(&mut assembler, &snapshot(4, 2)), (vec![5, 1], vec![1]));
        // After the reset, the same constraints tear in the same order.
        add_tears(&mut assembler, (9, 6), &[5, 1]);
        assert_eq!(torn_at(&mut assembler, &snapshot(9, 2)), (vec![5, 1], vec![5, 1]));
    }

    #[test]
    fn a_later_list_stands_in_for_one_that_was_overwritten() {
        let mut assembler = assembler();
        add_tears(&mut assembler, (4, 0), &[5, 1, 2]);
        assert_eq!(torn_at(&mut assembler, &snapshot(3, 2)), (vec![5, 1], vec![5, 1]));
        assert_eq!(torn_at(&mut assembler, &snapshot(4, 3)), (vec![5, 1, 2], vec![2]));
    }

    #[test]
    fn a_state_without_its_load_is_not_shown_and_a_load_begins_with_its_own_lists() {
        let mut assembler = assembler();
        add_tears(&mut assembler, (2, 0), &[5]);
        assert_eq!(torn_at(&mut assembler, &snapshot(2, 1)).0, [5]);
        let second = SnapshotHeader { topology_revision: 1, ..snapshot(3, 0) };
        assert!(assembler.assemble(&second, &[]).is_none());
        add_load(&mut assembler, 1);
        add_tears(&mut assembler, (3, 3), &[]);
        let state = assembler.assemble(&second, &[]).unwrap();
        assert_eq!((state.load.header.topology_revision, state.torn.len()), (1, 0));
        assert_eq!(state.changes[0], Change::Load);
    }

    #[test]
    fn the_rest_of_an_old_run_is_dropped_with_the_first_state_of_a_new_one() {
        let mut assembler = assembler();
        let first = snapshot(1, 0);
        assembler.assemble(&first, &[]).unwrap();
        assembler.add(&Update::Outcome(&outcome(0, 2)));
        assembler.add(&Update::Outcome(&Outcome { run_id: 8, ..outcome(0, 1) }));
        let header = LoadHeader { run_id: 8, ..LoadHeader::default() };
        assembler.add(&Update::Scene(&header, b""));
        assembler.add(&Update::Topology(&header, &[]));
        assembler.add(&Update::Surface(&header, &[]));
        let other = SnapshotHeader { run_id: 8, ..snapshot(1, 0) };
        let state = assembler.assemble(&other, &[]).unwrap();
        let expected = Outcome { run_id: 8, ..outcome(0, 1) };
        assert_eq!(state.changes, [Change::Load, Change::Outcome(expected)]);
        assert!(assembler.take_waiting().is_empty());
    }

    #[test]
    fn changes_that_wait_too_long_are_dropped_and_counted() {
        let mut assembler = StateAssembler::default();
        for index in 0..WAITING_MAX as u64 + 3 {
            assembler.add(&Update::Outcome(&outcome(index, 100)));
        }
        assert_eq!(assembler.lost_count(), 3);
    }
}
