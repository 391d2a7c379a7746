//! Generators: shapes that stand for many particles and constraints.

pub(super) mod bridge;
pub(super) mod cloth;
pub(super) mod mesh_file;
pub(super) mod ragdoll;
pub(super) mod rope;
pub(super) mod web;

use glam::DVec3;
use serde::Serialize;

use super::model::Model;
use sim_types::{ConstraintKind, Method};

use super::{Limits, SceneParticle, Softness, Up, decimal};
use crate::constraints::Constraint;
use crate::constraints::families::Sheet;
pub use bridge::Bridge;
pub use cloth::{Cloth, Diagonals};
pub use mesh_file::Obj;
pub use ragdoll::Ragdoll;
pub use rope::Rope;
pub use web::Web;

/// A shape, and what its particles and constraints are like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Generator {
    /// The shape.
    #[serde(flatten)]
    pub shape: Shape,
    /// Mass of each particle in kg.
    #[serde(with = "decimal::number")]
    pub mass: f32,
    /// Particles of the shape that are pinned.
    pub pinned: Pinned,
    /// How soft the constraints are.
    #[serde(flatten)]
    pub softness: KindSoftness,
    /// Length / rest length above which its constraints tear, instead of the scene's; infinity is
    /// off.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_stretch: Option<f32>,
}

/// The shapes.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Shape {
    /// A sheet that hangs.
    Cloth(Cloth),
    /// A sheet that holds its form: with bends, and nothing pinned, unless told.
    Mesh(Cloth),
    /// A line.
    Rope(Rope),
    /// A spider's web.
    Web(Web),
    /// Planks on two ropes.
    Bridge(Bridge),
    /// A figure.
    Ragdoll(Ragdoll),
    /// A mesh from a file.
    Obj(Obj),
}

/// Which particles of a shape are pinned.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Pinned {
    /// One of the words of the shape.
    Word(&'static str),
    /// Indices within the shape, ascending.
    List(Vec<u32>),
}

/// The softness of each kind of constraint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KindSoftness {
    /// In m/N (method xpbd).
    Compliance(PerKind),
    /// 0..=1 (method pbd).
    Stiffness(PerKind),
}

/// A number for each kind of constraint that generators make.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PerKind {
    /// Of constraints between direct neighbours.
    #[serde(with = "decimal::number")]
    pub structural: f32,
    /// Of constraints across a diagonal.
    #[serde(with = "decimal::number")]
    pub shear: f32,
    /// Of constraints between next neighbours but one.
    #[serde(with = "decimal::number")]
    pub bend: f32,
}

impl KindSoftness {
    /// Rigid, in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        let value = Softness::rigid(method).value();
        Self::new(method, PerKind { structural: value, shear: value, bend: value })
    }

    /// The numbers in the measure of a method.
    pub fn new(method: Method, per_kind: PerKind) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(per_kind),
            Method::Pbd => Self::Stiffness(per_kind),
        }
    }

    fn of(self, kind: ConstraintKind) -> f32 {
        let (Self::Compliance(values) | Self::Stiffness(values)) = self;
        match kind {
            ConstraintKind::Structural | ConstraintKind::Tether => values.structural,
            ConstraintKind::Shear => values.shear,
            ConstraintKind::Bend => values.bend,
        }
    }
}

impl Generator {
    /// Particles that it makes; at most 2^64, so it is known before any is made.
    pub(crate) fn particle_count(&self) -> u64 {
        match &self.shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.particle_count(),
            Shape::Rope(rope) => rope.particle_count(),
            Shape::Web(web) => web.particle_count(),
            Shape::Bridge(bridge) => bridge.particle_count(),
            Shape::Ragdoll(_) => Ragdoll::particle_count(),
            Shape::Obj(obj) => obj.particle_count(),
        }
    }

    /// Constraints that it makes.
    pub(crate) fn constraint_count(&self) -> u64 {
        match &self.shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.constraint_count(),
            Shape::Rope(rope) => rope.constraint_count(),
            Shape::Web(web) => web.constraint_count(),
            Shape::Bridge(bridge) => bridge.constraint_count(),
            Shape::Ragdoll(_) => Ragdoll::constraint_count(),
            Shape::Obj(obj) => obj.constraint_count(),
        }
    }

    pub(crate) fn build(&self, up: Up, model: &mut Model) {
        let first = model.particle_count();
        let tear_stretch = self.tear_stretch;
        model.begin_limits(Limits { tear_stretch, ..Limits::default() });
        let mut builder = Builder { generator: self, up, first, model };
        match &self.shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.build(&mut builder),
            Shape::Rope(rope) => rope.build(&mut builder),
            Shape::Web(web) => web.build(&mut builder),
            Shape::Bridge(bridge) => bridge.build(&mut builder),
            Shape::Ragdoll(ragdoll) => ragdoll.build(&mut builder),
            Shape::Obj(obj) => obj.build(&mut builder),
        }
    }
}

/// What a shape adds its parts to, by their indices within the shape.
struct Builder<'a> {
    generator: &'a Generator,
    up: Up,
    /// Index of the shape's first particle in the scene.
    first: u32,
    model: &'a mut Model,
}

impl<'a> Builder<'a> {
    fn pinned(&self) -> &'a Pinned {
        &self.generator.pinned
    }

    fn up(&self) -> DVec3 {
        match self.up {
            Up::Y => DVec3::Y,
            Up::MinusY => -DVec3::Y,
            Up::Z => DVec3::Z,
        }
    }

    fn particle(&mut self, position: [f32; 3], pinned: bool) {
        self.heavy_particle(position, pinned, self.generator.mass);
    }

    fn heavy_particle(&mut self, position: [f32; 3], pinned: bool, mass: f32) {
        self.model.particles.push(SceneParticle { position, mass, pinned, velocity: [0.0; 3] });
    }

    fn link(&mut self, pair: [u32; 2], kind: ConstraintKind) {
        self.family_link(pair, kind, None);
    }

    /// A constraint at the length that it has, of a family that declares itself independent.
    fn family_link(&mut self, pair: [u32; 2], kind: ConstraintKind, family: Option<u32>) {
        let [a, b] = pair.map(|index| self.first + index);
        let rest_length = self.model.distance(a, b);
        let compliance = self.generator.softness.of(kind);
        self.model.push(Constraint { a, b, rest_length, compliance, kind }, family);
    }

    /// The shape's particles, from the first on, are a sheet, all of whose links declare families.
    fn sheet(&mut self, columns: u32, rows: u32) {
        self.model.sheets.push(Sheet { first: self.first, columns, rows });
    }

    fn triangle(&mut self, corners: [u32; 3]) {
        self.model.triangles.push(corners.map(|corner| self.first + corner));
    }
}

/// A point of the way between two, rounded once.
fn between(from: [f32; 3], to: [f32; 3], share: f64) -> [f32; 3] {
    let along = |axis: usize| {
        let (from, to) = (f64::from(from[axis]), f64::from(to[axis]));
        round(from + (to - from) * share)
    };
    [along(0), along(1), along(2)]
}

#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the scene's f32")]
fn round(value: f64) -> f32 {
    value as f32
}
