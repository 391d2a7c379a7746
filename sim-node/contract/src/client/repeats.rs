//! Recognition of messages that an owner has published again, for a reader behind a network tunnel.

use sim_messages::{
    CollidersHeader, ForcesHeader, KeyframeHeader, LoadHeader, ParameterValues, ParametersHeader,
    SnapshotHeader, TearsHeader, Update,
};

/// The last message of each latched service.
#[derive(Debug, Default)]
pub(crate) struct Repeats {
    scene: Option<LoadHeader>,
    topology: Option<LoadHeader>,
    bends: Option<LoadHeader>,
    surface: Option<LoadHeader>,
    colliders: Option<CollidersHeader>,
    tears: Option<TearsHeader>,
    parameters: Option<(ParametersHeader, ParameterValues)>,
    forces: Option<ForcesHeader>,
    keyframe: Option<KeyframeHeader>,
    snapshot: Option<SnapshotHeader>,
}

impl Repeats {
    /// Returns `true` if the last message of the same service was the same one.
    pub(crate) fn is_repeated(&mut self, update: &Update<'_>) -> bool {
        match *update {
            Update::Scene(header, _) => is_same(&mut self.scene, *header),
            Update::Topology(header, _) => is_same(&mut self.topology, *header),
            Update::Bends(header, _) => is_same(&mut self.bends, *header),
            Update::Surface(header, _) => is_same(&mut self.surface, *header),
            Update::Colliders(header, _) => is_same(&mut self.colliders, *header),
            Update::Tears(header, _) => is_same(&mut self.tears, *header),
            // Several messages of one step have the same header.
            Update::Parameters(header, values) => {
                is_same(&mut self.parameters, (*header, values.clone()))
            }
            Update::Forces(header, _) => is_same(&mut self.forces, *header),
            Update::Keyframe(header, _) => is_same(&mut self.keyframe, *header),
            Update::Outcome(_) | Update::Status(_) => false,
        }
    }

    /// Returns `true` if the last snapshot was the same one.
    pub(crate) fn is_repeated_snapshot(&mut self, header: &SnapshotHeader) -> bool {
        is_same(&mut self.snapshot, *header)
    }
}

fn is_same<T: PartialEq>(last: &mut Option<T>, new: T) -> bool {
    let is_same = last.as_ref() == Some(&new);
    *last = Some(new);
    is_same
}
