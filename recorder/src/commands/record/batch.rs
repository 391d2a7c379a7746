//! What arrives between two waits, copied out of shared memory at once.

use recorder::{Message, OutcomeRow, StatusRow, SurfaceRow, TopologyRow};
use sim_contract::{
    ColliderState, CollidersHeader, KeyframeHeader, LoadHeader, OUTCOME_FLAG_CONTROL,
    ParticleState, SnapshotHeader, TearsHeader, Update,
};

/// What arrived in one batch, out of shared memory.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    pub(crate) snapshots: Vec<Snapshot>,
    /// Each with the run that it is of.
    pub(crate) updates: Vec<(u64, Message)>,
    /// Newest load, if one came.
    pub(crate) scene: Option<(LoadHeader, Vec<u8>)>,
    pub(crate) topology: Option<(LoadHeader, TopologyRow)>,
    pub(crate) surface: Option<(LoadHeader, SurfaceRow)>,
    pub(crate) colliders: Vec<(CollidersHeader, Vec<ColliderState>)>,
    /// All that tore since the load, each time, and why.
    pub(crate) tears: Vec<(TearsHeader, Vec<u32>)>,
    pub(crate) tear_causes: Vec<(TearsHeader, Vec<u8>)>,
    pub(crate) keyframes: Vec<(KeyframeHeader, Vec<u8>)>,
    pub(crate) outcomes: Vec<OutcomeRow>,
}

#[derive(Debug, Clone)]
pub(crate) struct Snapshot {
    pub(crate) header: SnapshotHeader,
    pub(crate) particles: Vec<ParticleState>,
}

impl Batch {
    /// Copies a snapshot.
    pub(crate) fn add_snapshot(&mut self, header: &SnapshotHeader, particles: &[ParticleState]) {
        self.snapshots.push(Snapshot { header: *header, particles: particles.to_vec() });
    }

    /// Copies anything else. Answers to those who control a replay are not part of its run.
    pub(crate) fn add_update(&mut self, update: Update<'_>) {
        match update {
            Update::Scene(header, bytes) => self.scene = Some((*header, bytes.to_vec())),
            Update::Topology(header, constraints) => {
                self.topology = Some((*header, TopologyRow::new(header, constraints)));
            }
            Update::Surface(header, triangles) => {
                self.surface = Some((*header, SurfaceRow::new(header, triangles)));
            }
            Update::Keyframe(header, bytes) => self.keyframes.push((*header, bytes.to_vec())),
            Update::Outcome(outcome) if outcome.flags & OUTCOME_FLAG_CONTROL != 0 => {}
            Update::Outcome(outcome) => self.outcomes.push(OutcomeRow::from(outcome)),
            Update::Status(status) => {
                let row = Message::Status(StatusRow::from(status));
                self.updates.push((status.run_id, row));
            }
            Update::Colliders(header, list) => self.colliders.push((*header, list.to_vec())),
            Update::Tears(header, list) => {
                let causes = list.iter().map(|one| u8::try_from(one.cause).unwrap_or(u8::MAX));
                self.tear_causes.push((*header, causes.collect()));
                let constraints = list.iter().map(|one| one.constraint);
                self.tears.push((*header, constraints.collect()));
            }
            Update::Parameters(..) => {}
        }
    }
}
