//! Expansion of a scene: every particle, constraint and triangle.

use std::sync::OnceLock;

use super::definition::element::Limits;
use super::definition::element::{BendParticles, SceneBend};
use super::definition::element::{SceneConstraint, SceneParticle};
use crate::constraints::Constraint;
use crate::constraints::bends::Bend;
use crate::constraints::families::Sheet;
use crate::constraints::incidence::Incidence;
use crate::constraints::sides::TornSides;
use sim_types::Method;

/// Every particle, constraint and triangle of a scene; immutable from load to load.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// The particles at load.
    pub particles: Vec<SceneParticle>,
    /// Explicit constraints first, then the constraints of each generator.
    pub constraints: Vec<Constraint>,
    /// By constraint: the group of independent constraints that its shape declares.
    pub families: Vec<Option<u32>>,
    /// Sheets that declare families.
    pub sheets: Vec<Sheet>,
    /// Distinct limits that replace the scene's.
    limits: Vec<Limits>,
    /// By constraint: index into `limits`.
    limit_indices: Vec<u32>,
    /// Block of the bends that are pushed.
    block: Option<u32>,
    /// By generated block: it has bends.
    pub bent_blocks: Vec<bool>,
    /// Explicit bends first, then the bends of each generator.
    pub bends: Vec<Bend>,
    /// By bend: the group of independent bends that its shape declares.
    pub bend_families: Vec<Option<u32>>,
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// By particle: it never touches others.
    pub is_without_contact: Vec<bool>,
    /// Meaning of the constraints' softness.
    pub method: Method,
    incidence: OnceLock<Incidence>,
}

/// Numbers of the elements that refer to particles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ModelSize {
    pub(crate) constraints: usize,
    pub(crate) bends: usize,
    pub(crate) triangles: usize,
}

impl Model {
    /// The constraints and bends of each particle. Found once, when forces are first measured.
    pub fn incidence(&self) -> &Incidence {
        let Self { particles, constraints, bends, .. } = self;
        self.incidence.get_or_init(|| Incidence::new(particles.len(), constraints, bends))
    }

    /// Creates a model with all particles of a scene.
    pub(crate) fn new(method: Method, particles: Vec<SceneParticle>) -> Self {
        let is_without_contact = vec![false; particles.len()];
        Self { particles, is_without_contact, method, ..Self::default() }
    }

    /// Makes room for exactly these numbers of elements. A list that grows takes up to twice its memory.
    pub(crate) fn reserve(&mut self, counts: ModelSize) {
        let ModelSize { constraints, bends, triangles } = counts;
        self.constraints.reserve_exact(constraints);
        self.families.reserve_exact(constraints);
        self.limit_indices.reserve_exact(constraints);
        self.bends.reserve_exact(bends);
        self.bend_families.reserve_exact(bends);
        self.triangles.reserve_exact(triangles);
    }

    /// Sets the limits of the constraints that are pushed from now on.
    pub(crate) fn set_limits(&mut self, limits: Limits) {
        if self.limits.last() != Some(&limits) {
            self.limits.push(limits);
        }
    }

    /// Begins the next generated block: bends that are pushed from now on belong to it.
    pub(crate) fn begin_block(&mut self) {
        #[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 blocks")]
        let block = self.bent_blocks.len() as u32;
        self.block = Some(block);
        self.bent_blocks.push(false);
    }

    /// Returns the limits of a constraint that replace the scene's.
    pub fn limits(&self, constraint: u32) -> Limits {
        self.limits[self.limits_index(constraint) as usize]
    }

    /// Returns the index of a constraint's own limits in [`Self::all_limits`].
    pub fn limits_index(&self, constraint: u32) -> u32 {
        self.limit_indices[constraint as usize]
    }

    /// Returns the limits that constraints have of their own.
    pub fn all_limits(&self) -> &[Limits] {
        &self.limits
    }

    /// Adds an explicit constraint with its own limits.
    pub(crate) fn push_explicit(&mut self, constraint: &SceneConstraint) {
        let SceneConstraint { particles: [a, b], rest_length, kind, softness, limits } =
            *constraint;
        self.set_limits(limits);
        self.push(Constraint { a, b, rest_length, compliance: softness.value(), kind }, None);
    }

    /// Adds a constraint, with the family that its shape declares.
    pub(crate) fn push(&mut self, constraint: Constraint, family: Option<u32>) {
        self.constraints.push(constraint);
        self.families.push(family);
        #[allow(clippy::cast_possible_truncation, reason = "at most one per constraint")]
        self.limit_indices.push(self.limits.len() as u32 - 1);
    }

    /// Adds an explicit bend.
    pub(crate) fn push_explicit_bend(&mut self, bend: &SceneBend) {
        let SceneBend { particles, rigidity } = *bend;
        let position = |index: u32| self.particles[index as usize].position;
        let bend = match particles {
            BendParticles::Line(line) => Bend::on_line(line, line.map(position), rigidity),
            BendParticles::Cell(cell) => Bend::of_cell(cell, cell.map(position), rigidity),
        };
        self.push_bend(bend, None);
    }

    /// Adds a bend, with the family that its shape declares.
    pub(crate) fn push_bend(&mut self, bend: Bend, family: Option<u32>) {
        self.bends.push(Bend { block: self.block, ..bend });
        if let Some(is_bent) = self.bent_blocks.last_mut() {
            *is_bent = true;
        }
        self.bend_families.push(family);
    }

    #[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 particles")]
    /// Returns the number of particles.
    pub fn particle_count(&self) -> u32 {
        self.particles.len() as u32
    }

    /// Returns the particles of a constraint.
    pub fn pair(&self, constraint: u32) -> [u32; 2] {
        let Constraint { a, b, .. } = self.constraints[constraint as usize];
        [a, b]
    }

    /// Returns the particles of each constraint.
    pub fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.constraints.iter().map(|one| [one.a, one.b])
    }

    /// Returns the sides of the paths of the bends, none of which is torn.
    pub fn bend_sides(&self) -> TornSides {
        let sides = (0_u32..).zip(&self.bends);
        let sides = sides.flat_map(|(index, bend)| bend.path().map(move |side| (index, side)));
        TornSides::new(self.pairs(), self.bends.len(), sides)
    }

    /// Returns the distance between two particles in f32, as a step measures it.
    pub fn distance(&self, a: u32, b: u32) -> f32 {
        self.distance_squared(a, b).sqrt()
    }

    /// Returns the square of the distance between two particles in f32.
    pub fn distance_squared(&self, a: u32, b: u32) -> f32 {
        let position = |index: u32| self.particles[index as usize].position;
        distance_squared(position(a), position(b))
    }
}

/// The positions of all particles of a scene: enough to read what refers to them.
pub(crate) struct Positions(pub(crate) Vec<[f32; 3]>);

impl Positions {
    /// Returns the distance between two particles in f32, as a step measures it.
    pub(crate) fn distance(&self, a: u32, b: u32) -> f32 {
        distance_squared(self.0[a as usize], self.0[b as usize]).sqrt()
    }
}

fn distance_squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    x * x + y * y + z * z
}
