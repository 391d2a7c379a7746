//! Coherent states, assembled from the messages of all services.

use sim_messages::{
    OUTCOME_FLAG_CONTROL, ParticleState, SnapshotHeader, TearsHeader, Torn, Update,
};

use crate::client::change::{Change, LostChanges, PendingChanges};
use crate::client::loaded_scene::{LoadedScene, PendingLoads};
use crate::client::views::{Colliders, Parameters};

/// A published state with everything that belongs to it, at the end of its step.
#[derive(Debug, Clone, Copy)]
pub struct State<'a> {
    /// Header of the snapshot.
    pub header: &'a SnapshotHeader,
    /// The particles, by index, in shared memory.
    pub particles: &'a [ParticleState],
    /// The load that the state belongs to.
    pub load: &'a LoadedScene,
    /// The `header.torn_count` torn constraints; fewer if a message
    /// was lost.
    pub torn: &'a Torn,
    /// The colliders. The `run_id` of their header is 0 until they have arrived.
    pub colliders: &'a Colliders,
    /// The parameters. In the first state after attaching to a paused node, they may be those of the
    /// next step; their header states the step.
    pub parameters: &'a Parameters,
    /// All changes since the state before, in the order of publication.
    pub changes: &'a [Change],
}

/// Assembles states.
#[derive(Debug, Default)]
pub(crate) struct StateAssembler {
    run_id: u64,
    load: Option<LoadedScene>,
    torn: Torn,
    colliders: Colliders,
    parameters: Parameters,
    /// Changes since the state before.
    changes: Vec<Change>,
    pending_loads: PendingLoads,
    pending_changes: PendingChanges,
}

impl StateAssembler {
    /// Keeps a message until its state arrives.
    pub(crate) fn add(&mut self, update: &Update<'_>) {
        let (loads, changes) = (&mut self.pending_loads, &mut self.pending_changes);
        match *update {
            Update::Scene(header, text) => {
                loads.get_or_insert(header).scene = Some(text.to_vec());
            }
            Update::Topology(header, constraints) => {
                loads.get_or_insert(header).topology = Some((*header, constraints.to_vec()));
            }
            Update::Bends(header, bends) => {
                loads.get_or_insert(header).bends = Some(bends.to_vec());
            }
            Update::Surface(header, triangles) => {
                loads.get_or_insert(header).triangles = Some(triangles.to_vec());
            }
            Update::Colliders(header, list) => {
                changes.push(header.run_id, header.step, Change::Colliders(*header, list.to_vec()));
            }
            Update::Tears(header, list) => {
                changes.push(header.run_id, header.step, Change::Tears(*header, list.to_vec()));
            }
            Update::Parameters(header, values) => {
                changes.push(
                    header.run_id,
                    header.step,
                    Change::Parameters(*header, values.clone()),
                );
            }
            Update::Forces(header, rows) => {
                changes.push(header.run_id, header.step, Change::Forces(*header, rows.to_vec()));
            }
            Update::Keyframe(header, bytes) => {
                changes.push(header.run_id, header.step, Change::Keyframe(*header, bytes.to_vec()));
            }
            Update::Outcome(outcome) if outcome.flags & OUTCOME_FLAG_CONTROL == 0 => {
                changes.push(outcome.run_id, outcome.step, Change::Outcome(*outcome));
            }
            Update::Outcome(_) | Update::Status(_) => {}
        }
    }

    /// Returns the numbers of changes that were dropped because their state did not arrive.
    pub(crate) fn lost_changes(&self) -> LostChanges {
        self.pending_changes.lost()
    }

    /// Returns `true` if the load of a snapshot has arrived.
    pub(crate) fn has_load(&self, header: &SnapshotHeader) -> bool {
        let is_present = self.load.as_ref().is_some_and(|load| load.has_snapshot(header));
        is_present || self.pending_loads.has(header)
    }

    /// Assembles the state of a snapshot. Returns `None` if its load has not arrived, for example
    /// right after attaching; a later snapshot then contains all changes.
    pub(crate) fn assemble<'a>(
        &'a mut self,
        header: &'a SnapshotHeader,
        particles: &'a [ParticleState],
    ) -> Option<State<'a>> {
        self.changes.clear();
        self.begin_run(header.run_id);
        self.begin_load(header);
        for change in self.pending_changes.drain_due(header) {
            self.apply(change);
        }
        self.complete_torn(header);
        self.complete_parameters(header);
        let load = self.load.as_ref().filter(|load| load.has_snapshot(header))?;
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

    /// Drops everything of the old run with the first snapshot of another run.
    fn begin_run(&mut self, run_id: u64) {
        if run_id != self.run_id {
            self.pending_changes.drop_run(self.run_id);
            self.run_id = run_id;
            self.load = None;
            self.torn = Torn::default();
            self.colliders = Colliders::default();
            self.parameters = Parameters::default();
        }
    }

    fn begin_load(&mut self, header: &SnapshotHeader) {
        if self.load.as_ref().is_some_and(|load| load.has_snapshot(header)) {
            return;
        }
        if let Some(load) = self.pending_loads.remove(header) {
            self.load = Some(load);
            self.changes.push(Change::Load);
        }
    }

    fn apply(&mut self, change: Change) {
        match &change {
            Change::Colliders(header, list) => {
                self.colliders.header = *header;
                self.colliders.colliders.clone_from(list);
            }
            Change::Parameters(header, values) => {
                self.parameters = Parameters { header: *header, values: values.clone() };
            }
            Change::Tears(header, list) => {
                let new = self.torn.replace(*header, list);
                self.changes.push(Change::Tears(*header, new));
                return;
            }
            Change::Load | Change::Forces(..) | Change::Keyframe(..) | Change::Outcome(_) => {}
        }
        self.changes.push(change);
    }

    /// Replaces a list of tears that was overwritten before it was read. A later list begins with it.
    fn complete_torn(&mut self, snapshot: &SnapshotHeader) {
        if self.torn.constraints.len() == snapshot.torn_count as usize {
            return;
        }
        let Some((later, list)) = self.pending_changes.tears(snapshot) else { return };
        let list = list[..snapshot.torn_count as usize].to_vec();
        let header = TearsHeader { step: snapshot.step, count: snapshot.torn_count, ..*later };
        let is_first = self.torn.header.run_id != header.run_id;
        let new = self.torn.replace(header, &list);
        // The constraints of a first list tore before this reader attached, in unknown steps.
        let new_count = if is_first { 0 } else { new.len() };
        self.torn.header.new_count = u32::try_from(new_count).unwrap_or(u32::MAX);
        self.changes.push(Change::Tears(self.torn.header, new));
    }

    /// Reads pending parameters if none of this run have arrived in time, as after attaching to a
    /// paused node.
    fn complete_parameters(&mut self, header: &SnapshotHeader) {
        if self.parameters.header.run_id != header.run_id
            && let Some(parameters) = self.pending_changes.parameters(header.run_id)
        {
            self.parameters = parameters;
        }
    }
}

#[cfg(test)]
mod tests {
    use sim_messages::{
        Action, Command, LoadHeader, Outcome, Parameter, ParameterValues, ParametersHeader,
        TearCause, TornConstraint,
    };

    use super::*;

    const RUN_ID: u64 = 7;

    fn snapshot(step: u64, torn_count: u32) -> SnapshotHeader {
        SnapshotHeader { run_id: RUN_ID, step, torn_count, ..SnapshotHeader::default() }
    }

    fn assembler() -> StateAssembler {
        let mut assembler = StateAssembler::default();
        add_load(&mut assembler, 0);
        add_tears(&mut assembler, Interval { since_step: 0, step: 0 }, &[]);
        assembler
    }

    fn add_load(assembler: &mut StateAssembler, topology_revision: u32) {
        let header = LoadHeader { run_id: RUN_ID, topology_revision, ..LoadHeader::default() };
        assembler.add(&Update::Scene(&header, b"version = 1"));
        assembler.add(&Update::Topology(&header, &[]));
        assembler.add(&Update::Bends(&header, &[]));
        assembler.add(&Update::Surface(&header, &[]));
    }

    /// Steps that a list of tears covers.
    #[derive(Clone, Copy)]
    struct Interval {
        since_step: u64,
        step: u64,
    }

    fn add_tears(assembler: &mut StateAssembler, interval: Interval, torn: &[u32]) {
        let Interval { since_step, step } = interval;
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
        let values = ParameterValues::default().with(Parameter::Damping, damping);
        assembler.add(&Update::Parameters(&header, &values));
    }

    fn outcome(index: u64, step: u64) -> Outcome {
        let command = Command::new(1, index, Action::Reset);
        Outcome { run_id: RUN_ID, ..Outcome::new(index, step, command, Ok(())) }
    }

    fn pairs(torn: &[u32]) -> Vec<TornConstraint> {
        torn.iter().map(|index| TornConstraint::new(*index, Some(TearCause::Cut))).collect()
    }

    /// Indices of the torn constraints in a state.
    #[derive(Debug, PartialEq)]
    struct TornIndices {
        all: Vec<u32>,
        new: Vec<u32>,
    }

    fn torn(all: &[u32], new: &[u32]) -> TornIndices {
        TornIndices { all: all.to_vec(), new: new.to_vec() }
    }

    fn torn_at(assembler: &mut StateAssembler, header: &SnapshotHeader) -> TornIndices {
        let indices = |list: &[TornConstraint]| list.iter().map(|torn| torn.constraint).collect();
        let state = assembler.assemble(header, &[]).unwrap();
        let new = state.changes.iter().filter_map(|change| match change {
            Change::Tears(_, new) => Some(indices(new)),
            _ => None,
        });
        TornIndices {
            all: state.torn.indices().collect(),
            new: new.flat_map(|list: Vec<u32>| list).collect(),
        }
    }

    #[test]
    fn a_change_belongs_to_the_first_state_at_or_after_its_step() {
        let mut assembler = assembler();
        add_damping(&mut assembler, 0, 0.0);
        add_damping(&mut assembler, 3, 3.0);
        assembler.add(&Update::Outcome(&outcome(0, 3)));
        let first = snapshot(2, 0);
        let state = assembler.assemble(&first, &[]).unwrap();
        assert_eq!(state.parameters.values.number(Parameter::Damping), 0.0);
        assert_eq!(state.changes[0], Change::Load);
        assert!(!state.changes.contains(&Change::Outcome(outcome(0, 3))));
        let second = snapshot(4, 0);
        let state = assembler.assemble(&second, &[]).unwrap();
        assert_eq!(
            (state.parameters.header.step, state.parameters.values.number(Parameter::Damping)),
            (3, 3.0)
        );
        assert_eq!(state.changes.len(), 2);
        assert_eq!(state.changes[1], Change::Outcome(outcome(0, 3)));
    }

    #[test]
    fn only_new_tears_are_changes_and_a_reset_starts_a_new_list() {
        let mut assembler = assembler();
        add_tears(&mut assembler, Interval { since_step: 0, step: 2 }, &[5]);
        add_tears(&mut assembler, Interval { since_step: 0, step: 4 }, &[5, 1]);
        assert_eq!(torn_at(&mut assembler, &snapshot(1, 0)), torn(&[], &[]));
        assert_eq!(torn_at(&mut assembler, &snapshot(2, 1)), torn(&[5], &[5]));
        assert_eq!(torn_at(&mut assembler, &snapshot(4, 2)), torn(&[5, 1], &[1]));
        // After the reset, the same constraints tear in the same order.
        add_tears(&mut assembler, Interval { since_step: 6, step: 9 }, &[5, 1]);
        assert_eq!(torn_at(&mut assembler, &snapshot(9, 2)), torn(&[5, 1], &[5, 1]));
    }

    #[test]
    fn a_later_list_replaces_an_overwritten_one() {
        let mut assembler = assembler();
        add_tears(&mut assembler, Interval { since_step: 0, step: 4 }, &[5, 1, 2]);
        assert_eq!(torn_at(&mut assembler, &snapshot(3, 2)), torn(&[5, 1], &[5, 1]));
        assert_eq!(torn_at(&mut assembler, &snapshot(4, 3)), torn(&[5, 1, 2], &[2]));
    }

    #[test]
    fn tears_before_the_first_state_are_not_new_in_it_and_overwritten_later_ones_are() {
        let mut assembler = StateAssembler::default();
        add_load(&mut assembler, 0);
        add_tears(&mut assembler, Interval { since_step: 0, step: 4 }, &[5, 1, 2, 3]);
        let first = snapshot(2, 2);
        let state = assembler.assemble(&first, &[]).unwrap();
        assert_eq!((state.torn.header.count, state.torn.header.new_count), (2, 0));
        let second = snapshot(3, 3);
        let state = assembler.assemble(&second, &[]).unwrap();
        assert_eq!((state.torn.header.count, state.torn.header.new_count), (3, 1));
    }

    #[test]
    fn a_snapshot_without_its_load_yields_no_state_and_a_load_starts_with_its_own_lists() {
        let mut assembler = assembler();
        add_tears(&mut assembler, Interval { since_step: 0, step: 2 }, &[5]);
        assert_eq!(torn_at(&mut assembler, &snapshot(2, 1)).all, [5]);
        let second = SnapshotHeader { topology_revision: 1, ..snapshot(3, 0) };
        assert!(assembler.assemble(&second, &[]).is_none());
        add_load(&mut assembler, 1);
        add_tears(&mut assembler, Interval { since_step: 3, step: 3 }, &[]);
        let state = assembler.assemble(&second, &[]).unwrap();
        assert_eq!((state.load.header.topology_revision, state.torn.constraints.len()), (1, 0));
        assert_eq!(state.changes[0], Change::Load);
    }

    #[test]
    fn the_first_state_of_a_run_drops_pending_changes_of_the_old_run() {
        let mut assembler = assembler();
        let first = snapshot(1, 0);
        assembler.assemble(&first, &[]).unwrap();
        assembler.add(&Update::Outcome(&outcome(0, 2)));
        assembler.add(&Update::Outcome(&Outcome { run_id: 8, ..outcome(0, 1) }));
        let header = LoadHeader { run_id: 8, ..LoadHeader::default() };
        assembler.add(&Update::Scene(&header, b""));
        assembler.add(&Update::Topology(&header, &[]));
        assembler.add(&Update::Bends(&header, &[]));
        assembler.add(&Update::Surface(&header, &[]));
        let other = SnapshotHeader { run_id: 8, ..snapshot(1, 0) };
        let state = assembler.assemble(&other, &[]).unwrap();
        let expected = Outcome { run_id: 8, ..outcome(0, 1) };
        assert_eq!(state.changes, [Change::Load, Change::Outcome(expected)]);
        assert!(assembler.pending_changes.drain_due(&snapshot(2, 0)).is_empty());
    }

    #[test]
    fn parameters_that_arrive_with_a_later_step_complete_the_first_state() {
        let mut assembler = assembler();
        add_damping(&mut assembler, 2, 3.0);
        let header = snapshot(1, 0);
        let state = assembler.assemble(&header, &[]).unwrap();
        assert_eq!(
            (state.parameters.header.step, state.parameters.values.number(Parameter::Damping)),
            (2, 3.0)
        );
    }
}
