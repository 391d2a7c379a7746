//! A load of a scene: everything that does not change until the next one.

use sim_contract::{BendState, ConstraintState, LoadHeader, ParticleState, Triangle};
use thiserror::Error;

use super::summary::SceneSummary;
use crate::sink::Topology;
use crate::wire::{Scene, SceneText, ShapeText, Stamp, scene_flag};

/// A load of a scene.
#[derive(Debug)]
pub(crate) struct Load {
    pub(crate) header: LoadHeader,
    pub(crate) summary: SceneSummary,
    pub(crate) constraints: Vec<ConstraintState>,
    pub(crate) bends: Vec<BendState>,
    pub(crate) triangles: Vec<Triangle>,
}

/// A contradiction between the parts of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub(crate) enum LoadError {
    /// An end of a constraint is not a particle.
    #[error("a constraint of the scene joins particles that do not exist")]
    Constraint,
    /// A particle of a bend does not exist.
    #[error("a bend of the scene has particles that do not exist")]
    Bend,
    /// A corner of a triangle is not a particle.
    #[error("a triangle of the scene has corners that do not exist")]
    Triangle,
}

impl Load {
    /// Checks that every index is in range. Any process of the user can write to shared memory, and
    /// anybody can write a file; a page would read beyond its arrays.
    pub(crate) fn checked(self, particle_count: u32) -> Result<Self, LoadError> {
        let is_particle = |index: &u32| *index < particle_count;
        if !self.constraints.iter().all(|one| is_particle(&one.a) && is_particle(&one.b)) {
            return Err(LoadError::Constraint);
        }
        if !self.bends.iter().all(|one| one.particles.iter().all(is_particle)) {
            return Err(LoadError::Bend);
        }
        if !self.triangles.iter().all(|one| one.corners.iter().all(is_particle)) {
            return Err(LoadError::Triangle);
        }
        Ok(self)
    }

    /// The message with the constraints and triangles.
    pub(crate) fn topology(&self) -> Topology<'_> {
        Topology {
            header: &self.header,
            constraints: &self.constraints,
            bends: &self.bends,
            triangles: &self.triangles,
        }
    }

    /// "xpbd" or "pbd".
    pub(crate) fn method(&self) -> &'static str {
        if self.header.method == 0 { "xpbd" } else { "pbd" }
    }

    /// Creates the message for the sinks, with the positions of a state.
    pub(crate) fn to_scene(&self, step: u64, particles: &[ParticleState]) -> Scene {
        let summary = &self.summary;
        let mut scene = Scene {
            stamp: Stamp { epoch: 0, step },
            flags: if summary.is_planar { scene_flag::PLANAR } else { 0 },
            rate_hz: self.header.rate_hz,
            origin: self.header.origin,
            text: SceneText {
                name: summary.name.clone(),
                unit: summary.unit.clone(),
                up: summary.up.name().to_owned(),
                run_id: format!("{:016x}", self.header.run_id),
                shapes: self.shapes(),
                has_explicit_bends: self.bends.iter().any(|bend| bend.block < 0),
                anchors: summary.poses.anchored().collect(),
            },
            collider_meshes: summary.collider_meshes.clone(),
            ..Scene::default()
        };
        scene.set_geometry(particles, &self.constraints, &self.triangles);
        scene
    }

    /// The generated shapes. Each is a block of the scene.
    fn shapes(&self) -> Vec<ShapeText> {
        let mut shapes = self.summary.shapes.clone();
        for bend in &self.bends {
            let block = usize::try_from(bend.block).ok();
            if let Some(shape) = block.and_then(|block| shapes.get_mut(block)) {
                shape.has_bends = true;
            }
        }
        shapes
    }
}
