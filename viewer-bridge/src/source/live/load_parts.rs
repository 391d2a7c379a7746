//! The three parts of a load, which arrive separately.

use sim_contract::{ConstraintState, LoadHeader, SnapshotHeader, Triangle};

use super::updates::Updates;
use crate::scene::load::{Load, LoadError};
use crate::scene::summary::SceneSummary;

/// The newest parts of a load that is not complete.
#[derive(Debug, Default)]
pub(super) struct LoadParts {
    scene: Option<(LoadHeader, Vec<u8>)>,
    topology: Option<(LoadHeader, Vec<ConstraintState>)>,
    surface: Option<(LoadHeader, Vec<Triangle>)>,
}

impl LoadParts {
    pub(super) fn update(&mut self, updates: &mut Updates) {
        replace_if_some(&mut self.scene, &mut updates.scene);
        replace_if_some(&mut self.topology, &mut updates.topology);
        replace_if_some(&mut self.surface, &mut updates.surface);
    }

    /// Returns the load of a snapshot once all its parts have arrived. A load that contradicts itself is
    /// dropped.
    pub(super) fn complete(
        &mut self,
        snapshot: &SnapshotHeader,
    ) -> Option<Result<Load, LoadError>> {
        let is_complete =
            self.scene.as_ref().is_some_and(|(header, _)| is_same_load(header, snapshot))
                && self.topology.as_ref().is_some_and(|(header, _)| is_same_load(header, snapshot))
                && self.surface.as_ref().is_some_and(|(header, _)| is_same_load(header, snapshot));
        if !is_complete {
            return None;
        }
        let (_, text) = self.scene.take()?;
        let (header, constraints) = self.topology.take()?;
        let (_, triangles) = self.surface.take()?;
        let summary = SceneSummary::from_toml(&String::from_utf8_lossy(&text)).unwrap_or_default();
        Some(Load { header, summary, constraints, triangles }.checked(snapshot.particle_count))
    }
}

/// Returns whether a state belongs to a load.
pub(super) fn is_same_load(load: &LoadHeader, snapshot: &SnapshotHeader) -> bool {
    (load.run_id, load.topology_revision, load.particle_count)
        == (snapshot.run_id, snapshot.topology_revision, snapshot.particle_count)
}

fn replace_if_some<T>(old: &mut Option<T>, new: &mut Option<T>) {
    if new.is_some() {
        *old = new.take();
    }
}
