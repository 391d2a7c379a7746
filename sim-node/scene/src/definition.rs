//! The checked scene, with every default filled in.

pub(crate) mod anchor;
pub(crate) mod bending;
pub(crate) mod collider;
pub(crate) mod element;
pub(crate) mod settings;

use std::ops::Range;

use serde::Serialize;
use sim_types::{ELEMENTS_MAX, Parameter, ParameterValues, STEP_WORK_MAX};

use super::fields::{At, Fields, SceneTable, print, printed};
use super::generate::rope::Rope;
use super::generate::{Generator, Shape};
use super::mesh::details::FaceDetails;
use super::model::{Model, ModelSize, Positions};
use crate::checks::StepSize;
use anchor::SceneAnchor;
use collider::{ColliderGeometry, ColliderMeshes, SceneCollider};
use element::{SceneBend, SceneConstraint, SceneParticle};
use settings::{
    ContactSettings, PASSES_MAX, RATE_HZ_MAX, SolverSettings, Up, Wind, parameter_values,
};

/// Version of the scene format.
pub const SCENE_VERSION: u32 = 1;

/// A checked scene with every default filled in.
#[derive(Debug, Clone, PartialEq)]
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
    pub gravity: [f32; 3],
    /// Rate, substeps and other settings of the solver.
    pub solver: SolverSettings,
    /// The air, if the scene has any.
    pub wind: Option<Wind>,
    /// Contacts of particles with each other.
    pub contact: ContactSettings,
    /// Explicit particles. They have the first indices.
    pub particles: Vec<SceneParticle>,
    /// Explicit constraints. They have the first indices and may join generated particles.
    pub constraints: Vec<SceneConstraint>,
    /// Explicit bends. They have the first indices of bends.
    pub bends: Vec<SceneBend>,
    /// Colliders, in the order in which they act.
    pub colliders: Vec<SceneCollider>,
    /// Particles that follow moving frames.
    pub anchors: Vec<SceneAnchor>,
    /// Generators of further particles and constraints, in order.
    pub generators: Vec<Generator>,
    /// Warnings from reading the scene and the files that it names, one sentence each.
    pub read_warnings: Vec<String>,
}

impl Scene {
    /// Returns an empty scene with the defaults.
    pub(super) fn blank(name: String) -> Self {
        Self {
            version: SCENE_VERSION,
            name,
            origin: [0.0; 3],
            dimensions: 3,
            up: Up::default(),
            unit: "m".to_owned(),
            gravity: ParameterValues::DEFAULT.vector(Parameter::Gravity),
            solver: SolverSettings::default(),
            wind: None,
            contact: ContactSettings::default(),
            particles: Vec::new(),
            generators: Vec::new(),
            constraints: Vec::new(),
            bends: Vec::new(),
            anchors: Vec::new(),
            colliders: Vec::new(),
            read_warnings: Vec::new(),
        }
    }

    /// Returns the complete scene as TOML, with every default written out. Reading this text gives
    /// an equal scene.
    pub fn to_toml(&self) -> String {
        print(&mut self.clone())
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

    /// Returns the parameters of the scene. Its colliders have values of their own.
    pub fn parameter_values(&self) -> ParameterValues {
        parameter_values(self.gravity, &self.solver, &self.contact, self.wind.as_ref())
    }

    /// Returns the unit of energy: "J" for metres, and for another unit of length a unit such as "kg cm²/s²".
    pub fn energy_unit(&self) -> String {
        match self.unit.as_str() {
            "m" => "J".to_owned(),
            unit => format!("kg {unit}²/s²"),
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
    pub fn model(&self) -> Model {
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
        generated.fold(self.particles.len() as u64, u64::saturating_add)
    }

    /// Visits the explicit particles first, then the particles of each generator.
    fn for_each_particle(&self, visit: &mut dyn FnMut(SceneParticle)) {
        self.particles.iter().copied().for_each(&mut *visit);
        for generator in &self.generators {
            generator.for_each_particle(self.up, visit);
        }
    }
}

impl SceneTable for Scene {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        if fields.find("version").is_none() {
            fields.error("version", "is missing (allowed: 1)");
        }
        fields.whole("version", &mut self.version, SCENE_VERSION..=SCENE_VERSION);
        if fields.problem_count() > 0 {
            return fields.stop();
        }
        fields.value("name", &mut self.name, read_name, printed);
        fields.value("origin", &mut self.origin, read_origin, printed);
        fields.whole("dimensions", &mut self.dimensions, 2..=3);
        if let Some(reader) = fields.reader() {
            reader.is_planar.set(self.dimensions == 2);
        }
        fields.word("up", &mut self.up, &Up::NAMES);
        let read = |at: At<'_>| at.quoted_text().map(str::to_owned);
        fields.value("unit", &mut self.unit, read, printed);
        fields.vector("gravity", &mut self.gravity);
        let problem_count = fields.problem_count();
        fields.table("solver", &mut self.solver);
        if let Some(reader) = fields.reader() {
            reader.is_method_known.set(fields.problem_count() == problem_count);
        }
        fields.optional_table("wind", &mut self.wind);
        fields.table("contact", &mut self.contact);
        let (method, problem_count) = (self.solver.method, fields.problem_count());
        fields.tables("particle", &mut self.particles, &SceneParticle::default());
        let shape = Shape::Rope(Rope::blank());
        fields.tables("generate", &mut self.generators, &Generator::blank(shape, method));
        if let Some(reader) = fields.reader().filter(|_| fields.problem_count() == problem_count) {
            let count = u32::try_from(self.particle_count()).ok();
            reader.particle_count.set(count.filter(|count| *count <= ELEMENTS_MAX));
        }
        fields.tables("constraint", &mut self.constraints, &SceneConstraint::blank(method));
        fields.tables("bend", &mut self.bends, &SceneBend::default());
        fields.tables("anchor", &mut self.anchors, &SceneAnchor::default());
        let shape = ColliderGeometry::Sphere { center: [0.0; 3], radius: 1.0 };
        fields.tables("collider", &mut self.colliders, &SceneCollider::blank(shape));
    }
}

fn read_name(at: At<'_>) -> Option<String> {
    match at.line()? {
        "" => at.error("is empty (allowed: a line of text)"),
        name => Some(name.to_owned()),
    }
}

fn read_origin(at: At<'_>) -> Option<[f64; 3]> {
    let [x, y, z] = at.numbers()?.map(|axis| axis.double());
    let origin = [x?, y?, z?];
    let Some(axis) = origin.iter().find(|axis| !axis.is_finite()) else { return Some(origin) };
    at.error(format!("{axis} is not finite (allowed: finite numbers)"))
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
