//! The builders that shapes append their particles and constraints to.

use glam::DVec3;
use sim_types::ConstraintKind;

use super::pinned::Pinned;
use crate::constraints::Constraint;
use crate::constraints::bends::Bend;
use crate::constraints::families::Sheet;
use crate::definition::element::{KindSoftness, SceneParticle};
use crate::definition::settings::Up;
use crate::model::Model;

/// Creates the particles of one shape.
pub(super) struct ParticleBuilder<'a> {
    pub(super) pinned: &'a Pinned,
    /// Mass of each particle, unless the shape gives another one, in kg.
    pub(super) mass: f32,
    pub(super) up: Up,
    /// Number of particles so far.
    pub(super) count: u32,
    /// Receives each particle.
    pub(super) visit: &'a mut dyn FnMut(SceneParticle),
}

impl ParticleBuilder<'_> {
    /// Returns the unit vector that points up.
    pub(super) fn up(&self) -> DVec3 {
        match self.up {
            Up::Y => DVec3::Y,
            Up::MinusY => -DVec3::Y,
            Up::Z => DVec3::Z,
        }
    }

    /// Adds a particle. `is_pinned_by` decides whether a word of the shape pins it.
    pub(super) fn particle(&mut self, position: [f32; 3], is_pinned_by: impl FnOnce(&str) -> bool) {
        let pinned = self.pinned.contains(self.count, is_pinned_by);
        self.count += 1;
        let (mass, velocity) = (self.mass, [0.0; 3]);
        (self.visit)(SceneParticle { position, mass, pinned, velocity });
    }
}

/// Appends the constraints and triangles of one shape to a model with its particles. All indices count
/// from the shape's first particle.
pub(super) struct ConstraintBuilder<'a> {
    pub(super) softness: KindSoftness,
    /// Index of the shape's first particle in the scene.
    pub(super) first: u32,
    pub(super) model: &'a mut Model,
}

impl ConstraintBuilder<'_> {
    /// Appends a constraint whose rest length is the distance of its particles.
    pub(super) fn link(&mut self, pair: [u32; 2], kind: ConstraintKind) {
        self.push_link(pair, kind, None);
    }

    /// Appends a constraint of a family of independent constraints.
    pub(super) fn family_link(&mut self, pair: [u32; 2], kind: ConstraintKind, family: u32) {
        self.push_link(pair, kind, Some(family));
    }

    fn push_link(&mut self, pair: [u32; 2], kind: ConstraintKind, family: Option<u32>) {
        let [a, b] = pair.map(|index| self.first + index);
        let rest_length = self.model.distance(a, b);
        let compliance = self.softness.value(kind);
        self.model.push(Constraint { a, b, rest_length, compliance, kind }, family);
    }

    /// Declares the shape a sheet. All of its links must be family links, and each of its cells must have two
    /// triangles, in the order of [`Sheet::first_triangle`].
    #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 triangles")]
    pub(super) fn sheet(&mut self, columns: u32, rows: u32) {
        let first_triangle = self.model.triangles.len() as u32;
        self.model.sheets.push(Sheet { first: self.first, columns, rows, first_triangle });
    }

    /// Appends a bend.
    pub(super) fn bend(&mut self, bend: Bend) {
        let particles = bend.particles.map(|index| self.first + index);
        self.model.push_bend(Bend { particles, ..bend }, None);
    }

    /// Appends a triangle of the surface.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        self.model.triangles.push(corners.map(|corner| self.first + corner));
    }
}

/// Interpolates linearly between two points and rounds once.
pub(super) fn interpolate(from: [f32; 3], to: [f32; 3], share: f64) -> [f32; 3] {
    let along = |axis: usize| {
        let (from, to) = (f64::from(from[axis]), f64::from(to[axis]));
        round(from + (to - from) * share)
    };
    [along(0), along(1), along(2)]
}

/// Rounds to the scene's f32.
#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the scene's f32")]
pub(super) fn round(value: f64) -> f32 {
    value as f32
}
