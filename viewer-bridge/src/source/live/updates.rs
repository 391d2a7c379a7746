//! The messages of the node since the last read. They are copies, because shared memory is on loan.

use sim_contract::{
    ColliderState, CollidersHeader, ConstraintState, LoadHeader, NodeStatus, Outcome,
    ParameterValues, Tap, TearsHeader, TornConstraint, Triangle, Update,
};

/// The newest message of each service, but all tears, colliders and outcomes.
#[derive(Debug, Default)]
pub(super) struct Updates {
    pub(super) scene: Option<(LoadHeader, Vec<u8>)>,
    pub(super) topology: Option<(LoadHeader, Vec<ConstraintState>)>,
    pub(super) surface: Option<(LoadHeader, Vec<Triangle>)>,
    pub(super) colliders: Vec<(CollidersHeader, Vec<ColliderState>)>,
    pub(super) tears: Vec<(TearsHeader, Vec<TornConstraint>)>,
    pub(super) parameters: Option<ParameterValues>,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) status: Option<NodeStatus>,
}

impl Updates {
    /// Reads the messages that have arrived. Drops unreadable ones: a viewer shows the next one.
    pub(super) fn drain(tap: &mut Tap) -> Self {
        let mut updates = Self::default();
        tap.drain_updates(|update| updates.add(update));
        updates
    }

    fn add(&mut self, update: Update<'_>) {
        match update {
            Update::Scene(header, text) => self.scene = Some((*header, text.to_vec())),
            Update::Topology(header, all) => self.topology = Some((*header, all.to_vec())),
            Update::Surface(header, all) => self.surface = Some((*header, all.to_vec())),
            Update::Colliders(header, all) => self.colliders.push((*header, all.to_vec())),
            Update::Tears(header, all) => self.tears.push((*header, all.to_vec())),
            Update::Parameters(_, values) => self.parameters = Some(*values),
            Update::Outcome(outcome) => self.outcomes.push(*outcome),
            Update::Status(status) => self.status = Some(*status),
            // Only the solver reads it.
            Update::Keyframe(..) => {}
        }
    }

    /// The run of the newest message, if it is known.
    pub(super) fn run_id(&self) -> Option<u64> {
        let load = self.topology.as_ref().map(|(header, _)| header.run_id);
        load.or(self.status.map(|status| status.run_id))
    }
}
