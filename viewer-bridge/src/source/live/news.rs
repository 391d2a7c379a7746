//! What came from the node since the last look: copies, for shared memory is on loan.

use sim_contract::{
    ColliderState, CollidersHeader, ConstraintState, LoadHeader, NodeStatus, Outcome, Tap,
    TearsHeader, Triangle, Update,
};

/// The newest message of each kind that came; all of what belongs to a step, and all outcomes.
#[derive(Debug, Default)]
pub(super) struct News {
    pub(super) scene: Option<(LoadHeader, Vec<u8>)>,
    pub(super) topology: Option<(LoadHeader, Vec<ConstraintState>)>,
    pub(super) surface: Option<(LoadHeader, Vec<Triangle>)>,
    pub(super) colliders: Vec<(CollidersHeader, Vec<ColliderState>)>,
    pub(super) tears: Vec<(TearsHeader, Vec<u32>)>,
    pub(super) tear_causes: Vec<(TearsHeader, Vec<u8>)>,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) status: Option<NodeStatus>,
}

impl News {
    /// Takes what has come. Messages that cannot be read are dropped: a viewer shows the next one.
    pub(super) fn drain(tap: &mut Tap) -> Self {
        let mut news = Self::default();
        tap.drain_updates(|update| news.add(update));
        news
    }

    fn add(&mut self, update: Update<'_>) {
        match update {
            Update::Scene(header, text) => self.scene = Some((*header, text.to_vec())),
            Update::Topology(header, all) => self.topology = Some((*header, all.to_vec())),
            Update::Surface(header, all) => self.surface = Some((*header, all.to_vec())),
            Update::Colliders(header, all) => self.colliders.push((*header, all.to_vec())),
            Update::Tears(header, all) => {
                let causes = all.iter().map(|one| u8::try_from(one.cause).unwrap_or(u8::MAX));
                self.tear_causes.push((*header, causes.collect()));
                self.tears.push((*header, all.iter().map(|one| one.constraint).collect()));
            }
            Update::Parameters(..) => {}
            Update::Outcome(outcome) => self.outcomes.push(*outcome),
            Update::Status(status) => self.status = Some(*status),
            // It is for the solver.
            Update::Keyframe(..) => {}
        }
    }

    /// The run that the newest of it belongs to, if anything of it says.
    pub(super) fn run_id(&self) -> Option<u64> {
        let load = self.topology.as_ref().map(|(header, _)| header.run_id);
        load.or(self.status.map(|status| status.run_id))
    }
}
