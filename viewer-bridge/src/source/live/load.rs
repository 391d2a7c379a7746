//! A load of the node: its three parts, until they are together and checked.

use sim_contract::{ConstraintState, LoadHeader, SnapshotHeader, Triangle};

use super::news::News;
use crate::scene::load::Load;
use crate::scene::summary::SceneSummary;

/// The parts of the newest load as they come.
#[derive(Debug, Default)]
pub(super) struct Parts {
    scene: Option<(LoadHeader, Vec<u8>)>,
    topology: Option<(LoadHeader, Vec<ConstraintState>)>,
    surface: Option<(LoadHeader, Vec<Triangle>)>,
}

impl Parts {
    pub(super) fn take(&mut self, news: &mut News) {
        take_newer(&mut self.scene, &mut news.scene);
        take_newer(&mut self.topology, &mut news.topology);
        take_newer(&mut self.surface, &mut news.surface);
    }

    /// The load that a snapshot belongs to, once all its parts are here. `Err`: it contradicts
    /// itself, and is dropped.
    pub(super) fn complete(
        &mut self,
        snapshot: &SnapshotHeader,
    ) -> Option<Result<Load, &'static str>> {
        let is_complete = self.scene.as_ref().is_some_and(|(header, _)| is_of(header, snapshot))
            && self.topology.as_ref().is_some_and(|(header, _)| is_of(header, snapshot))
            && self.surface.as_ref().is_some_and(|(header, _)| is_of(header, snapshot));
        if !is_complete {
            return None;
        }
        let (_, text) = self.scene.take()?;
        let (header, constraints) = self.topology.take()?;
        let (_, triangles) = self.surface.take()?;
        let summary = SceneSummary::read(&String::from_utf8_lossy(&text));
        Some(Load { header, summary, constraints, triangles }.checked(snapshot.particle_count))
    }
}

/// Whether a state is one of a load.
pub(super) fn is_of(load: &LoadHeader, snapshot: &SnapshotHeader) -> bool {
    (load.run_id, load.topology_revision, load.particle_count)
        == (snapshot.run_id, snapshot.topology_revision, snapshot.particle_count)
}

fn take_newer<T>(place: &mut Option<T>, newer: &mut Option<T>) {
    if newer.is_some() {
        *place = newer.take();
    }
}
