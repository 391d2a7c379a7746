//! The messages that arrive between two waits, copied out of shared memory.

use recorder::{
    CollidersRow, Message, OutcomeRow, ParametersRow, StatusRow, SurfaceRow, TopologyRow,
};
use sim_contract::{
    KeyframeHeader, LoadHeader, OUTCOME_FLAG_CONTROL, ParticleState, SnapshotHeader, Update,
};

use super::tear_log::TearList;

/// The messages that arrived together.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    pub(crate) snapshots: Vec<Snapshot>,
    pub(crate) statuses: Vec<RunMessage<Message>>,
    /// The newest load, if one arrived.
    pub(crate) scene: Option<(LoadHeader, Vec<u8>)>,
    pub(crate) topology: Option<(LoadHeader, TopologyRow)>,
    pub(crate) surface: Option<(LoadHeader, SurfaceRow)>,
    /// The row is `None` if it has a shape of another version.
    pub(crate) colliders: Vec<RunMessage<Option<CollidersRow>>>,
    pub(crate) parameters: Vec<RunMessage<Option<ParametersRow>>>,
    pub(crate) tears: Vec<TearList>,
    pub(crate) keyframes: Vec<(KeyframeHeader, Vec<u8>)>,
    pub(crate) outcomes: Vec<OutcomeRow>,
}

/// A row with its run and step.
#[derive(Debug, Clone)]
pub(crate) struct RunMessage<Row> {
    pub(crate) run_id: u64,
    pub(crate) step: u64,
    pub(crate) row: Row,
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

    /// Copies another message. Skips the answers of a replay to its controls, which are not part of
    /// the recorded run.
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
                let (run_id, step) = (status.run_id, status.step);
                self.statuses.push(RunMessage { run_id, step, row });
            }
            Update::Colliders(header, list) => {
                let (run_id, step) = (header.run_id, header.step);
                let row = CollidersRow::new(step, list);
                self.colliders.push(RunMessage { run_id, step, row });
            }
            Update::Parameters(header, values) => {
                let (run_id, step) = (header.run_id, header.step);
                let row = Some(ParametersRow { step, values: *values });
                self.parameters.push(RunMessage { run_id, step, row });
            }
            Update::Tears(header, torn) => {
                self.tears.push(TearList { header: *header, torn: torn.to_vec() });
            }
        }
    }
}
