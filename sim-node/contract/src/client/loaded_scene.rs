//! Loaded scenes, and the loads whose messages have arrived in part.

use std::collections::VecDeque;

use sim_messages::{BendState, ConstraintState, LoadHeader, SnapshotHeader, Triangle};

/// A scene with everything that stays the same until the next load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadedScene {
    /// Identity of the load.
    pub header: LoadHeader,
    /// The scene as TOML.
    pub scene: Vec<u8>,
    /// The constraints, by index.
    pub constraints: Vec<ConstraintState>,
    /// The bends, by index; may be empty.
    pub bends: Vec<BendState>,
    /// The surface; may be empty.
    pub triangles: Vec<Triangle>,
}

impl LoadedScene {
    /// Returns `true` if a snapshot belongs to this load.
    pub(crate) fn has_snapshot(&self, snapshot: &SnapshotHeader) -> bool {
        LoadKey::from(&self.header) == LoadKey::from(snapshot)
    }
}

/// Identity of a load among all runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct LoadKey {
    run_id: u64,
    topology_revision: u32,
}

impl From<&LoadHeader> for LoadKey {
    fn from(header: &LoadHeader) -> Self {
        Self { run_id: header.run_id, topology_revision: header.topology_revision }
    }
}

impl From<&SnapshotHeader> for LoadKey {
    fn from(header: &SnapshotHeader) -> Self {
        Self { run_id: header.run_id, topology_revision: header.topology_revision }
    }
}

/// The parts of a load that have arrived.
#[derive(Debug, Default)]
pub(crate) struct PartialLoad {
    key: LoadKey,
    pub(crate) scene: Option<Vec<u8>>,
    pub(crate) topology: Option<(LoadHeader, Vec<ConstraintState>)>,
    pub(crate) bends: Option<Vec<BendState>>,
    pub(crate) triangles: Option<Vec<Triangle>>,
}

impl PartialLoad {
    fn is_complete(&self) -> bool {
        self.scene.is_some()
            && self.topology.is_some()
            && self.bends.is_some()
            && self.triangles.is_some()
    }

    fn complete(self) -> Option<LoadedScene> {
        let (header, constraints) = self.topology?;
        Some(LoadedScene {
            header,
            scene: self.scene?,
            constraints,
            bends: self.bends?,
            triangles: self.triangles?,
        })
    }
}

/// Most pending loads. At the limit, the oldest load is dropped.
const PENDING_MAX: usize = 4;

/// The loads that wait for their first state, in the order of arrival.
#[derive(Debug, Default)]
pub(crate) struct PendingLoads(VecDeque<PartialLoad>);

impl PendingLoads {
    /// Returns the load of a header, which is empty at first.
    pub(crate) fn get_or_insert(&mut self, header: &LoadHeader) -> &mut PartialLoad {
        let key = LoadKey::from(header);
        let index = self.0.iter().position(|load| load.key == key).unwrap_or_else(|| {
            if self.0.len() == PENDING_MAX {
                self.0.pop_front();
            }
            self.0.push_back(PartialLoad { key, ..PartialLoad::default() });
            self.0.len() - 1
        });
        &mut self.0[index]
    }

    /// Returns `true` if the load of a snapshot is complete.
    pub(crate) fn has(&self, snapshot: &SnapshotHeader) -> bool {
        self.index_of(snapshot).is_some()
    }

    fn index_of(&self, snapshot: &SnapshotHeader) -> Option<usize> {
        let key = LoadKey::from(snapshot);
        self.0.iter().position(|load| load.key == key && load.is_complete())
    }

    /// Removes the load of a snapshot, if it is complete, and all loads before it, which have no more
    /// states.
    pub(crate) fn remove(&mut self, snapshot: &SnapshotHeader) -> Option<LoadedScene> {
        let index = self.index_of(snapshot)?;
        self.0.drain(..index);
        self.0.pop_front().and_then(PartialLoad::complete)
    }
}
