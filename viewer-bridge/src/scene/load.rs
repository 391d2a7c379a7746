//! A load: the scene, with everything that does not change until the next one.

use sim_contract::{ConstraintState, LoadHeader, ParticleState, Triangle};

use crate::scene::summary::SceneSummary;
use crate::wire::{Scene, SceneText, Stamp, scene_flag};

/// A load that is on show.
#[derive(Debug)]
pub(crate) struct Load {
    pub(crate) header: LoadHeader,
    pub(crate) summary: SceneSummary,
    pub(crate) constraints: Vec<ConstraintState>,
    pub(crate) triangles: Vec<Triangle>,
}

impl Load {
    /// Any process of the user can write into shared memory, and anybody a file: a page would read
    /// beyond its arrays.
    pub(crate) fn checked(self, particle_count: u32) -> Result<Self, &'static str> {
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
    pub(crate) fn method(&self) -> &'static str {
        if self.header.method == 0 { "xpbd" } else { "pbd" }
    }

    /// What pages are sent, with the positions of a snapshot.
    pub(crate) fn to_scene(&self, step: u64, particles: &[ParticleState]) -> Scene {
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
