//! Generators: shapes that expand to many particles and constraints.

mod bending;
pub(super) mod bridge;
mod builder;
pub(super) mod cloth;
pub(super) mod folds;
mod hinges;
pub(super) mod obj;
pub(super) mod pinned;
pub(super) mod ragdoll;
pub(super) mod rope;
pub(super) mod web;

use sim_types::{ConstraintKind, Method, Parameter};

use super::definition::element::{KindSoftness, Limits, SceneParticle};
use super::definition::settings::Up;
use super::fields::{Fields, MASS, NamedKeys, SceneTable, TableShape};
use super::model::Model;
use bridge::Bridge;
use builder::{ConstraintBuilder, ParticleBuilder};
use cloth::Cloth;
use obj::Obj;
use pinned::Pinned;
use ragdoll::Ragdoll;
use rope::Rope;
use web::Web;

/// A shape with the properties of its particles and constraints.
#[derive(Debug, Clone, PartialEq)]
pub struct Generator {
    /// The shape.
    pub shape: Shape,
    /// Mass of each particle in kg.
    pub mass: f32,
    /// Pinned particles of the shape.
    pub pinned: Pinned,
    /// Softness of the constraints, by kind.
    pub softness: KindSoftness,
    /// Length / rest length above which the constraints tear, in place of the scene's limit.
    /// Infinity is off.
    pub tear_stretch: Option<f32>,
    /// The particles touch others, in a scene in which particles do; default true.
    pub contact: bool,
}

impl Generator {
    /// Returns a shape with the defaults.
    pub(super) fn blank(shape: Shape, method: Method) -> Self {
        Self {
            shape,
            mass: 1.0,
            pinned: Pinned::Word("none"),
            softness: KindSoftness::rigid(method),
            tear_stretch: None,
            contact: true,
        }
    }
}

impl SceneTable for Generator {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        if !fields.shape(&mut self.shape) {
            return;
        }
        let problem_count = fields.problem_count();
        match &mut self.shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.fields(fields),
            Shape::Rope(rope) => rope.fields(fields),
            Shape::Web(web) => web.fields(fields),
            Shape::Bridge(bridge) => bridge.fields(fields),
            Shape::Ragdoll(ragdoll) => ragdoll.fields(fields),
            Shape::Obj(obj) => obj.fields(fields, &mut self.pinned),
        }
        fields.number("mass", &mut self.mass, MASS);
        if let Some(words) = self.shape.pin_words() {
            let is_read = fields.problem_count() == problem_count;
            let count = Some(self.shape.particle_count()).filter(|_| is_read);
            self.pinned.key(fields, words, count);
        }
        let range = Parameter::TearStretch.info().range;
        fields.limit("tear_stretch", &mut self.tear_stretch, range);
        fields.flag("contact", &mut self.contact, true);
        self.softness.key(fields);
        if let Shape::Obj(obj) = &mut self.shape {
            obj.details.name_fields(fields, obj.faces.len());
        }
    }
}

/// Shape of a generator.
#[derive(Debug, Clone, PartialEq)]
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
    /// Name in scene files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Cloth(_) => "cloth",
            Self::Mesh(_) => "mesh",
            Self::Rope(_) => "rope",
            Self::Web(_) => "web",
            Self::Bridge(_) => "bridge",
            Self::Ragdoll(_) => "ragdoll",
            Self::Obj(_) => "obj",
        }
    }
}

impl TableShape for Shape {
    fn word(&self) -> &'static str {
        self.name()
    }

    fn blanks() -> Vec<Self> {
        use ConstraintKind::{Bend, Shear, Structural};
        vec![
            Self::Cloth(Cloth::blank(&[Structural, Shear])),
            Self::Mesh(Cloth::blank(&[Structural, Shear, Bend])),
            Self::Rope(Rope::blank()),
            Self::Web(Web::blank()),
            Self::Bridge(Bridge::blank()),
            Self::Ragdoll(Ragdoll::blank()),
            Self::Obj(Obj::default()),
        ]
    }

    fn keys() -> Vec<NamedKeys> {
        let keys = |shape: Self| {
            NamedKeys::new(shape.name(), &mut Generator::blank(shape, Method::default()))
        };
        Self::blanks().into_iter().map(keys).collect()
    }
}

impl Shape {
    /// Returns the words for pinned particles, the default first; none of a mesh, whose words are expressions.
    fn pin_words(&self) -> Option<&'static [&'static str]> {
        match self {
            Self::Cloth(_) => Some(&cloth::PIN_WORDS),
            Self::Mesh(_) => Some(&["none", "top", "top-even", "corners"]),
            Self::Rope(_) => Some(&pinned::END_WORDS),
            Self::Web(_) => Some(&web::PIN_WORDS),
            Self::Bridge(_) => Some(&["both", "first", "last", "none"]),
            Self::Ragdoll(_) => Some(&ragdoll::PIN_WORDS),
            Self::Obj(_) => None,
        }
    }

    /// Returns the number of particles that the shape expands to, without expanding it.
    pub fn particle_count(&self) -> u64 {
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
    pub fn constraint_count(&self) -> u64 {
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

impl Shape {
    /// Returns the number of triangles that the shape expands to.
    pub(crate) fn triangle_count(&self) -> u64 {
        match self {
            Self::Cloth(cloth) | Self::Mesh(cloth) => cloth.triangle_count(),
            Self::Bridge(bridge) => 2 * bridge.particle_count(),
            Self::Obj(obj) => obj.triangle_count(),
            Self::Rope(_) | Self::Web(_) | Self::Ragdoll(_) => 0,
        }
    }

    /// Returns the number of bends that the shape expands to.
    pub fn bend_count(&self) -> u64 {
        match self {
            Self::Cloth(cloth) | Self::Mesh(cloth) => cloth.bend_count(),
            Self::Rope(rope) => rope.bend_count(),
            Self::Obj(obj) => obj.bend_count(),
            Self::Web(_) | Self::Bridge(_) | Self::Ragdoll(_) => 0,
        }
    }
}

impl Generator {
    /// Visits the shape's particles.
    pub(crate) fn for_each_particle(&self, up: Up, visit: &mut dyn FnMut(SceneParticle)) {
        let Self { shape, mass, pinned, .. } = self;
        let mut builder = ParticleBuilder { pinned, mass: *mass, up, count: 0, visit };
        match shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.build_particles(&mut builder),
            Shape::Rope(rope) => rope.build_particles(&mut builder),
            Shape::Web(web) => web.build_particles(&mut builder),
            Shape::Bridge(bridge) => bridge.build_particles(&mut builder),
            Shape::Ragdoll(ragdoll) => ragdoll.build_particles(&mut builder),
            Shape::Obj(obj) => obj.build_particles(&mut builder),
        }
    }

    /// Appends the shape's constraints, triangles and bends to a model that has its particles. `first` is the
    /// index of the first one.
    pub(crate) fn build_constraints(&self, first: u32, model: &mut Model) {
        let Self { shape, softness, tear_stretch, .. } = self;
        model.set_limits(Limits { tear_stretch: *tear_stretch, ..Limits::default() });
        let mut builder = ConstraintBuilder { softness: *softness, first, model };
        match shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.build_constraints(&mut builder),
            Shape::Rope(rope) => rope.build_constraints(&mut builder),
            Shape::Web(web) => web.build_constraints(&mut builder),
            Shape::Bridge(bridge) => bridge.build_constraints(&mut builder),
            Shape::Ragdoll(_) => Ragdoll::build_constraints(&mut builder),
            Shape::Obj(obj) => obj.build_constraints(&mut builder),
        }
        match shape {
            Shape::Cloth(cloth) | Shape::Mesh(cloth) => cloth.build_bends(&mut builder),
            Shape::Rope(rope) => rope.build_bends(&mut builder),
            Shape::Obj(obj) => obj.build_bends(&mut builder),
            Shape::Web(_) | Shape::Bridge(_) | Shape::Ragdoll(_) => {}
        }
    }
}
