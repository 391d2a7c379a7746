//! Generators: shapes that expand to many particles and constraints.

pub(super) mod bridge;
mod builder;
pub(super) mod cloth;
pub(super) mod obj;
pub(super) mod pinned;
pub(super) mod ragdoll;
pub(super) mod rope;
pub(super) mod web;

use serde::Serialize;

use super::definition::decimal;
use super::definition::limits::Limits;
use super::definition::settings::Up;
use super::definition::softness::KindSoftness;
use super::model::Model;
use bridge::Bridge;
use builder::Builder;
use cloth::Cloth;
use obj::Obj;
use pinned::Pinned;
use ragdoll::Ragdoll;
use rope::Rope;
use web::Web;

/// A shape with the properties of its particles and constraints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Generator {
    /// The shape.
    #[serde(flatten)]
    pub shape: Shape,
    /// Mass of each particle in kg.
    #[serde(with = "decimal::number")]
    pub mass: f32,
    /// Pinned particles of the shape.
    pub pinned: Pinned,
    /// Softness of the constraints, by kind.
    #[serde(flatten)]
    pub softness: KindSoftness,
    /// Length / rest length above which the constraints tear, in place of the scene's limit.
    /// Infinity is off.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_stretch: Option<f32>,
}

/// Shape of a generator.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Shape {
    /// A hanging sheet.
    Cloth(Cloth),
    /// A sheet that keeps its shape: by default it has bends, and nothing is pinned.
    Mesh(Cloth),
    /// A line.
    Rope(Rope),
    /// A spider's web.
    Web(Web),
    /// Planks on two ropes.
    Bridge(Bridge),
    /// A human figure.
    Ragdoll(Ragdoll),
    /// A mesh of polygons, usually from an OBJ file.
    Obj(Obj),
}

impl Shape {
    /// Returns the number of particles that the shape expands to, without expanding it.
    pub(crate) fn particle_count(&self) -> u64 {
        match self {
            Self::Cloth(cloth) | Self::Mesh(cloth) => cloth.particle_count(),
            Self::Rope(rope) => rope.particle_count(),
            Self::Web(web) => web.particle_count(),
            Self::Bridge(bridge) => bridge.particle_count(),
            Self::Ragdoll(_) => Ragdoll::particle_count(),
            Self::Obj(obj) => obj.particle_count(),
        }
    }

    /// Returns the number of constraints that the shape expands to.
    pub(crate) fn constraint_count(&self) -> u64 {
        match self {
            Self::Cloth(cloth) | Self::Mesh(cloth) => cloth.constraint_count(),
            Self::Rope(rope) => rope.constraint_count(),
            Self::Web(web) => web.constraint_count(),
            Self::Bridge(bridge) => bridge.constraint_count(),
            Self::Ragdoll(_) => Ragdoll::constraint_count(),
            Self::Obj(obj) => obj.constraint_count(),
        }
    }
}

impl Generator {
    /// Appends the shape's particles, constraints and triangles to a model.
    pub(crate) fn build(&self, up: Up, model: &mut Model) {
        let Self { shape, mass, pinned, softness, tear_stretch } = self;
        model.set_limits(Limits { tear_stretch: *tear_stretch, ..Limits::default() });
        let first = model.particle_count();
        let mut builder = Builder { pinned, mass: *mass, softness: *softness, up, first, model };
        match shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.build(&mut builder),
            Shape::Rope(rope) => rope.build(&mut builder),
            Shape::Web(web) => web.build(&mut builder),
            Shape::Bridge(bridge) => bridge.build(&mut builder),
            Shape::Ragdoll(ragdoll) => ragdoll.build(&mut builder),
            Shape::Obj(obj) => obj.build(&mut builder),
        }
    }
}
