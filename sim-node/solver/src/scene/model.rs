//! What a scene expands to: every particle, constraint and triangle.

use sim_types::Method;

use super::{Limits, Scene, SceneParticle};
use crate::constraints::Constraint;
use crate::constraints::families::Sheet;

/// Every particle, constraint and triangle of a scene; immutable from load to load.
#[derive(Debug, Clone, Default)]
pub(crate) struct Model {
    pub(crate) particles: Vec<SceneParticle>,
    /// By index.
    pub(crate) constraints: Vec<Constraint>,
    /// Constraint by constraint: the group of independent constraints that its shape declares.
    pub(crate) families: Vec<Option<u32>>,
    /// Sheets that declare families.
    pub(crate) sheets: Vec<Sheet>,
    /// Limits that stand in place of the scene's.
    limits: Vec<Limits>,
    /// Constraint by constraint: its place in `limits`.
    limits_of: Vec<u32>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// What the softness of the constraints means.
    pub(crate) method: Method,
}

impl Model {
    /// Explicit particles first, then those of each generator; constraints alike.
    pub(crate) fn new(scene: &Scene) -> Self {
        let method = scene.solver.method;
        let mut model = Self { particles: scene.particles.clone(), method, ..Self::default() };
        for constraint in &scene.constraints {
            let [a, b] = constraint.particles;
            let compliance = constraint.softness.value();
            let (rest_length, kind) = (constraint.rest_length, constraint.kind);
            model.begin_limits(constraint.limits);
            model.push(Constraint { a, b, rest_length, compliance, kind }, None);
        }
        for generator in &scene.generators {
            generator.build(scene.up, &mut model);
        }
        model
    }

    /// The constraints that follow have these limits of their own.
    pub(crate) fn begin_limits(&mut self, limits: Limits) {
        if self.limits.last() != Some(&limits) {
            self.limits.push(limits);
        }
    }

    /// The limits of a constraint in place of the scene's.
    pub(crate) fn limits(&self, constraint: u32) -> Limits {
        self.limits[self.limits_index(constraint) as usize]
    }

    /// Index of a constraint's own limits in [`Self::all_limits`].
    pub(crate) fn limits_index(&self, constraint: u32) -> u32 {
        self.limits_of[constraint as usize]
    }

    /// Returns the limits that constraints have of their own.
    pub(crate) fn all_limits(&self) -> &[Limits] {
        &self.limits
    }

    pub(crate) fn push(&mut self, constraint: Constraint, family: Option<u32>) {
        self.constraints.push(constraint);
        self.families.push(family);
        #[allow(clippy::cast_possible_truncation, reason = "at most one per constraint")]
        self.limits_of.push(self.limits.len() as u32 - 1);
    }

    #[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 particles")]
    pub(crate) fn particle_count(&self) -> u32 {
        self.particles.len() as u32
    }

    pub(crate) fn pair(&self, constraint: u32) -> [u32; 2] {
        let Constraint { a, b, .. } = self.constraints[constraint as usize];
        [a, b]
    }

    /// The distance of two particles in f32, as a step would measure it.
    pub(crate) fn distance(&self, a: u32, b: u32) -> f32 {
        self.distance_squared(a, b).sqrt()
    }

    pub(crate) fn distance_squared(&self, a: u32, b: u32) -> f32 {
        let (a, b) = (self.particles[a as usize].position, self.particles[b as usize].position);
        let [x, y, z] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        x * x + y * y + z * z
    }
}
