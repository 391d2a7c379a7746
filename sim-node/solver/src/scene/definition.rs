//! The checked scene, with every default filled in.

pub(crate) mod anchor;
pub(crate) mod bending;
pub(crate) mod collider;
pub(crate) mod contact;
pub(crate) mod decimal;
pub(crate) mod element;
pub(crate) mod limits;
pub(crate) mod settings;
pub(crate) mod softness;
pub(crate) mod wind;

use std::ops::Range;

use serde::Serialize;
use sim_types::STEP_WORK_MAX;

use super::generate::{Generator, Shape};
use super::mesh::details::FaceDetails;
use super::model::{Model, ModelSize, Positions};
use crate::checks::StepSize;
use anchor::SceneAnchor;
use bending::SceneBend;
use collider::{ColliderMeshes, SceneCollider};
use contact::ContactSettings;
use element::{SceneConstraint, SceneParticle};
use settings::{PASSES_MAX, RATE_HZ_MAX, SolverSettings, Up};
use wind::Wind;

/// Version of the scene format.
pub const SCENE_VERSION: u32 = 1;

/// A checked scene with every default filled in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// [`SCENE_VERSION`].
    pub version: u32,
    /// Name; by default the stem of the file's name.
    pub name: String,
    /// Origin of all positions, in `unit`.
    pub origin: [f64; 3],
    /// 2 or 3. In 2-D, z stays 0 bit for bit.
    pub dimensions: u32,
    /// Axis that points up. It affects only the drawing and some shapes, not gravity.
    pub up: Up,
    /// Unit of length. It affects only labels.
    pub unit: String,
    /// Acceleration in unit/s^2.
    #[serde(with = "decimal::vector")]
    pub gravity: [f32; 3],
    /// Rate, substeps and other settings of the solver.
    pub solver: SolverSettings,
    /// The air, if the scene has any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wind: Option<Wind>,
    /// Contacts of particles with each other.
    pub contact: ContactSettings,
    /// Explicit particles. They have the first indices.
    #[serde(rename = "particle", skip_serializing_if = "Vec::is_empty")]
    pub particles: Vec<SceneParticle>,
    /// Explicit constraints. They have the first indices and may join generated particles.
    #[serde(rename = "constraint", skip_serializing_if = "Vec::is_empty")]
    pub constraints: Vec<SceneConstraint>,
    /// Explicit bends. They have the first indices of bends.
    #[serde(rename = "bend", skip_serializing_if = "Vec::is_empty")]
    pub bends: Vec<SceneBend>,
    /// Colliders, in the order in which they act.
    #[serde(rename = "collider", skip_serializing_if = "Vec::is_empty")]
    pub colliders: Vec<SceneCollider>,
    /// Particles that follow moving frames.
    #[serde(rename = "anchor", skip_serializing_if = "Vec::is_empty")]
    pub anchors: Vec<SceneAnchor>,
    /// Generators of further particles and constraints, in order.
    #[serde(rename = "generate", skip_serializing_if = "Vec::is_empty")]
    pub generators: Vec<Generator>,
    /// Warnings from reading the scene and the files that it names, one sentence each.
    #[serde(skip)]
    pub read_warnings: Vec<String>,
}

impl Scene {
    /// Returns the complete scene as TOML, with every default written out. Reading this text gives
    /// an equal scene.
    ///
    /// # Panics
    /// Never: every checked scene has a TOML form.
    #[allow(clippy::expect_used, reason = "numbers, names and lists always have a TOML form")]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene has a TOML form")
    }

    /// Replaces the scene's rate and number of substeps where a value is given.
    ///
    /// # Errors
    /// A value is out of range, or a step exceeds [`STEP_WORK_MAX`]. The text names the field and the range.
    pub fn override_solver(
        &mut self,
        rate_hz: Option<u32>,
        substeps: Option<u32>,
    ) -> Result<(), String> {
        let check = |name, value, max| {
            if (1..=max).contains(&value) {
                Ok(value)
            } else {
                Err(format!("{name}: {value} is out of range (allowed: 1 to {max})"))
            }
        };
        if let Some(rate_hz) = rate_hz {
            self.solver.rate_hz = check("rate", rate_hz, RATE_HZ_MAX)?;
        }
        if let Some(substeps) = substeps {
            self.solver.substeps = check("substeps", substeps, PASSES_MAX)?;
            self.check_step_work().map_err(|problem| format!("substeps: {problem}"))?;
        }
        Ok(())
    }

    /// Checks that a step makes no more work than [`STEP_WORK_MAX`].
    pub(crate) fn check_step_work(&self) -> Result<(), String> {
        let SolverSettings { substeps, iterations, .. } = self.solver;
        let size = self.step_size();
        if size.allows(substeps, iterations) {
            return Ok(());
        }
        let StepSize { particles, constraints, colliders } = size;
        Err(format!(
            "a step of {substeps} substeps x ({constraints} constraints x {iterations} iterations + \
             {particles} particles x ({colliders} colliders + 1)) is {} projections and tests \
             (allowed: {STEP_WORK_MAX})",
            size.work(substeps, iterations)
        ))
    }

    fn step_size(&self) -> StepSize {
        let generated = self.generators.iter().map(|generator| &generator.shape);
        let generated = generated.map(|shape| shape.constraint_count() + shape.bend_count());
        let explicit = (self.constraints.len() + self.bends.len()) as u64;
        StepSize {
            particles: self.particle_count(),
            constraints: explicit + generated.sum::<u64>(),
            colliders: self.colliders.len() as u64,
        }
    }

    /// Returns the triangles of the colliders that are meshes, for drawing.
    pub fn collider_meshes(&self) -> ColliderMeshes {
        let colliders = self.colliders.iter().enumerate();
        colliders.filter_map(|(index, one)| Some((index, one.mesh.clone()?))).collect()
    }

    /// Returns the generated shapes with their particles, in the order of the file.
    pub fn shapes(&self) -> impl Iterator<Item = (&Shape, Range<u64>)> {
        let mut end = self.particles.len() as u64;
        self.generators.iter().map(move |generator| {
            let first = end;
            end += generator.shape.particle_count();
            (&generator.shape, first..end)
        })
    }

    /// Removes what only exports use of the meshes. Returns `true` if there was any.
    pub(crate) fn remove_face_details(&mut self) -> bool {
        let mut has_removed = false;
        for generator in &mut self.generators {
            if let Shape::Obj(obj) = &mut generator.shape {
                has_removed |= std::mem::take(&mut obj.details) != FaceDetails::default();
            }
        }
        has_removed
    }

    /// Counts particles, constraints and pinned particles, including the generated ones.
    pub fn counts(&self) -> SceneCounts {
        let model = self.model();
        SceneCounts {
            particles: model.particles.len(),
            constraints: model.constraints.len(),
            bends: model.bends.len(),
            pins: model.particles.iter().filter(|particle| particle.pinned).count(),
            triangles: model.triangles.len(),
            colliders: self.colliders.len(),
            anchors: self.anchors.len(),
        }
    }

    /// Expands the scene: explicit particles first, then those of each generator, and constraints and
    /// bends likewise.
    pub(crate) fn model(&self) -> Model {
        let mut particles = self.room_for_particles();
        self.for_each_particle(&mut |particle| particles.push(particle));
        let mut model = Model::new(self.solver.method, particles);
        model.reserve(self.model_size());
        for constraint in &self.constraints {
            model.push_explicit(constraint);
        }
        for bend in &self.bends {
            model.push_explicit_bend(bend);
        }
        let mut first = self.particles.len() as u64;
        for generator in &self.generators {
            model.begin_block();
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a scene has at most 2^24 particles"
            )]
            generator.build_constraints(first as u32, &mut model);
            let end = first + generator.shape.particle_count();
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a scene has at most 2^24 particles"
            )]
            model.is_without_contact[first as usize..end as usize].fill(!generator.contact);
            first = end;
        }
        model
    }

    /// Returns the numbers of explicit and generated elements.
    #[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 of anything")]
    pub(crate) fn model_size(&self) -> ModelSize {
        let sum = |count: fn(&Shape) -> u64| {
            self.generators.iter().map(|one| count(&one.shape)).sum::<u64>() as usize
        };
        ModelSize {
            constraints: self.constraints.len() + sum(Shape::constraint_count),
            bends: self.bends.len() + sum(Shape::bend_count),
            triangles: sum(Shape::triangle_count),
        }
    }

    /// Returns the positions of all particles.
    pub(crate) fn positions(&self) -> Positions {
        let mut positions = self.room_for_particles();
        self.for_each_particle(&mut |particle| positions.push(particle.position));
        Positions(positions)
    }

    #[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 particles")]
    fn room_for_particles<T>(&self) -> Vec<T> {
        Vec::with_capacity(self.particle_count() as usize)
    }

    /// Returns the number of particles, including the generated ones.
    pub(crate) fn particle_count(&self) -> u64 {
        let generated = self.generators.iter().map(|generator| generator.shape.particle_count());
        self.particles.len() as u64 + generated.sum::<u64>()
    }

    /// Visits the explicit particles first, then those of each generator.
    fn for_each_particle(&self, visit: &mut dyn FnMut(SceneParticle)) {
        self.particles.iter().copied().for_each(&mut *visit);
        for generator in &self.generators {
            generator.for_each_particle(self.up, visit);
        }
    }
}

/// Size of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Particles.
    pub particles: usize,
    /// Constraints.
    pub constraints: usize,
    /// Bends.
    pub bends: usize,
    /// Pinned particles.
    pub pins: usize,
    /// Triangles of the surface.
    pub triangles: usize,
    /// Colliders.
    pub colliders: usize,
    /// Anchors.
    pub anchors: usize,
}
