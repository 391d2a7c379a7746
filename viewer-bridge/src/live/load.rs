//! A load of the node: its three parts, until they are together and checked.

use sim_contract::{ConstraintState, LoadHeader, ParticleState, SnapshotHeader, Triangle};

use super::news::News;
use crate::scene_text::SceneSummary;
use crate::wire::{Scene, SceneText, Stamp, scene_flag};

/// The parts of the newest load as they come.
#[derive(Debug, Default)]
pub(super) struct Parts {
    scene: Option<(LoadHeader, Vec<u8>)>,
    topology: Option<(LoadHeader, Vec<ConstraintState>)>,
    surface: Option<(LoadHeader, Vec<Triangle>)>,
}

/// A load that is on show.
#[derive(Debug)]
pub(super) struct Load {
    pub(super) header: LoadHeader,
    pub(super) summary: SceneSummary,
    pub(super) constraints: Vec<ConstraintState>,
    triangles: Vec<Triangle>,
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
        let is_of = |header: &LoadHeader| {
            (header.run_id, header.topology_revision)
                == (snapshot.run_id, snapshot.topology_revision)
        };
        let is_complete = self.scene.as_ref().is_some_and(|(header, _)| is_of(header))
            && self.topology.as_ref().is_some_and(|(header, _)| is_of(header))
            && self.surface.as_ref().is_some_and(|(header, _)| is_of(header));
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

fn take_newer<T>(place: &mut Option<T>, newer: &mut Option<T>) {
    if newer.is_some() {
        *place = newer.take();
    }
}

impl Load {
    /// Any process of the user can write into shared memory: a page would read beyond its arrays.
    fn checked(self, particle_count: u32) -> Result<Self, &'static str> {
        let is_particle = |index: &u32| *index < particle_count;
        if !self.constraints.iter().all(|one| is_particle(&one.a) && is_particle(&one.b)) {
            return Err("a constraint of the scene joins particles that it does not have");
        }
        if !self.triangles.iter().all(|one| one.corners.iter().all(is_particle)) {
            return Err("a triangle of the scene has corners that it does not have");
        }
        Ok(self)
    }

    /// "xpbd" or "pbd".
    pub(super) fn method(&self) -> &'static str {
        if self.header.method == 0 { "xpbd" } else { "pbd" }
    }

    /// What pages are sent, with the positions of a snapshot.
    pub(super) fn to_scene(&self, step: u64, particles: &[ParticleState]) -> Scene {
        let summary = &self.summary;
        let flag = |is_set: bool, flag: u32| if is_set { flag } else { 0 };
        let count = particles.len() as u64;
        let is_inside = |first: u32, columns: u32, rows: u32| {
            u64::from(first) + u64::from(columns) * u64::from(rows) <= count
        };
        let mut scene = Scene {
            stamp: Stamp { epoch: 0, step },
            flags: flag(summary.is_planar, scene_flag::PLANAR)
                | flag(summary.is_tearable, scene_flag::TEARABLE)
                | flag(summary.has_tethers, scene_flag::TETHERS)
                | flag(self.header.method != 0, scene_flag::PBD),
            rate_hz: self.header.rate_hz,
            origin: self.header.origin,
            text: SceneText {
                name: summary.name.clone(),
                unit: summary.unit.clone(),
                up: summary.up.clone(),
                run_id: format!("{:016x}", self.header.run_id),
                grids: summary
                    .grids
                    .iter()
                    .copied()
                    .filter(|grid| is_inside(grid.first, grid.columns, grid.rows))
                    .collect(),
            },
            ..Scene::default()
        };
        scene.set_geometry(particles, &self.constraints, &self.triangles);
        scene
    }
}
