//! Explicit particles, constraints and bends of a scene.

use sim_types::{ConstraintKind, Method, NumberRange, Parameter};

use crate::fields::{At, Fields, MASS, RIGIDITY, SceneTable, printed};

/// An explicit particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneParticle {
    /// Relative to the scene's origin.
    pub position: [f32; 3],
    /// In kg, > 0. A pinned particle keeps its mass for a later unpin.
    pub mass: f32,
    /// Fixed at its position.
    pub pinned: bool,
    /// In unit/s; 0 if pinned.
    pub velocity: [f32; 3],
}

impl Default for SceneParticle {
    fn default() -> Self {
        Self { position: [0.0; 3], mass: 1.0, pinned: false, velocity: [0.0; 3] }
    }
}

impl SceneTable for SceneParticle {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.point("position", &mut self.position);
        fields.number("mass", &mut self.mass, MASS);
        fields.value("pinned", &mut self.pinned, |at| at.flag(), printed);
        fields.vector("velocity", &mut self.velocity);
        if self.pinned && self.velocity != [0.0; 3] {
            fields.error("velocity", "a pinned particle has a velocity (allowed: [0, 0, 0])");
        }
    }
}

/// An explicit constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneConstraint {
    /// Indices of two different particles.
    pub particles: [u32; 2],
    /// In the scene's unit, >= 0; by default the distance of the particles at load.
    pub rest_length: f32,
    /// Role of the constraint.
    pub kind: ConstraintKind,
    /// Softness in the measure of the scene's method.
    pub softness: Softness,
    /// Limits that replace the scene's. Infinity is off.
    pub limits: Limits,
}

impl SceneConstraint {
    /// Returns a constraint with the defaults.
    pub(crate) fn blank(method: Method) -> Self {
        Self {
            particles: [0; 2],
            rest_length: 0.0,
            kind: ConstraintKind::default(),
            softness: Softness::rigid(method),
            limits: Limits::default(),
        }
    }
}

impl SceneTable for SceneConstraint {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.require("particles", "two indices");
        fields.value("particles", &mut self.particles, different_pair, printed);
        fields.number("rest_length", &mut self.rest_length, NumberRange::AT_LEAST_ZERO);
        fields.word("kind", &mut self.kind, &ConstraintKind::ALL.map(|kind| (kind.name(), kind)));
        let method = self.softness.method();
        let [own, other] = softness_keys(method);
        let mut value = self.softness.value();
        fields.number(own, &mut value, softness_range(method));
        self.softness = Softness::new(method, value);
        refuse_other_softness(fields, method, other);
        self.limits.fields(fields);
    }
}

fn different_pair(at: At<'_>) -> Option<[u32; 2]> {
    let [a, b] = at.numbers()?;
    let [a, b] = [a.particle()?, b.particle()?];
    if a != b {
        return Some([a, b]);
    }
    at.error(format!("joins particle {a} to itself (allowed: two different particles)"))
}

/// An explicit bend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneBend {
    /// Indices of its particles.
    pub particles: BendParticles,
    /// Bending rigidity >= 0: EI in N m^2 of a line, B in N m of a cell.
    pub rigidity: f32,
}

impl Default for SceneBend {
    fn default() -> Self {
        Self { particles: BendParticles::Line([0; 3]), rigidity: 0.0 }
    }
}

impl SceneTable for SceneBend {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.require("particles", "3 or 4 indices");
        let print = |particles: &BendParticles| printed(particles.indices());
        fields.value("particles", &mut self.particles, BendParticles::read, print);
        fields.require("rigidity", RIGIDITY.text);
        fields.number("rigidity", &mut self.rigidity, RIGIDITY);
    }
}

/// The different particles of an explicit bend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BendParticles {
    /// Neighbours on a line, which is straight at rest.
    Line([u32; 3]),
    /// Corners of a cell, a parallelogram at rest: two above, two below.
    Cell([u32; 4]),
}

impl BendParticles {
    /// The particles in order.
    pub(crate) fn indices(&self) -> &[u32] {
        match self {
            Self::Line(line) => line,
            Self::Cell(cell) => cell,
        }
    }

    fn read(at: At<'_>) -> Option<Self> {
        let allowed = "3 or 4 numbers";
        let Some(list) = at.as_list() else { return at.unexpected(allowed) };
        let count = list.len();
        if !(3..=4).contains(&count) {
            return at.wrong_length(count, allowed);
        }
        let indices: Vec<_> = list.map(|index| index.particle()).collect::<Option<_>>()?;
        let mut sorted = indices.clone();
        sorted.sort_unstable();
        if let Some([twice, ..]) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return at
                .error(format!("names particle {twice} twice (allowed: different particles)"));
        }
        match indices[..] {
            [a, b, c, d] => Some(Self::Cell([a, b, c, d])),
            _ => Some(Self::Line([indices[0], indices[1], indices[2]])),
        }
    }
}

/// Limits at which a constraint stops stretching, and at which it tears. In the scene's settings
/// `None` is off. In a constraint `None` is the scene's limit, and infinity is off.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Limits {
    /// Largest length / rest length, > 1. It is enforced after the soft passes, at full stiffness.
    pub max_stretch: Option<f32>,
    /// Length / rest length above which the constraint tears, > 1.
    pub tear_stretch: Option<f32>,
    /// Length beyond the rest length above which the constraint tears, in the scene's unit, >= 0.
    pub tear_distance: Option<f32>,
    /// Force above which the constraint tears, in N, > 0.
    pub tear_force: Option<f32>,
}

impl Limits {
    /// Returns these limits, with the other's in place of those that are `None`.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            max_stretch: self.max_stretch.or(other.max_stretch),
            tear_stretch: self.tear_stretch.or(other.tear_stretch),
            tear_distance: self.tear_distance.or(other.tear_distance),
            tear_force: self.tear_force.or(other.tear_force),
        }
    }

    pub(super) fn fields(&mut self, fields: &mut Fields<'_>) {
        let range = |parameter: Parameter| parameter.info().range;
        fields.limit("max_stretch", &mut self.max_stretch, range(Parameter::MaxStretch));
        fields.limit("tear_stretch", &mut self.tear_stretch, range(Parameter::TearStretch));
        fields.limit("tear_distance", &mut self.tear_distance, range(Parameter::TearDistance));
        fields.limit("tear_force", &mut self.tear_force, range(Parameter::TearForce));
    }
}

/// Softness of a constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Softness {
    /// In m/N, >= 0; 0 is rigid (method xpbd).
    Compliance(f32),
    /// 0..=1; 1 is rigid (method pbd).
    Stiffness(f32),
}

impl Softness {
    /// Returns the softness with this number in the measure of a method.
    pub fn new(method: Method, value: f32) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(value),
            Method::Pbd => Self::Stiffness(value),
        }
    }

    /// Returns the softness of a rigid constraint in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(0.0),
            Method::Pbd => Self::Stiffness(1.0),
        }
    }

    /// Returns the bare number.
    pub fn value(self) -> f32 {
        match self {
            Self::Compliance(value) | Self::Stiffness(value) => value,
        }
    }

    fn method(self) -> Method {
        match self {
            Self::Compliance(_) => Method::Xpbd,
            Self::Stiffness(_) => Method::Pbd,
        }
    }
}

/// Softness of each kind of constraint in a generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindSoftness {
    /// The measure of the numbers: a compliance in m/N, or a stiffness 0..=1.
    method: Method,
    /// Of constraints between direct neighbours.
    structural: f32,
    /// Of constraints along a diagonal.
    shear: f32,
    /// Of constraints between second neighbours.
    bend: f32,
}

impl KindSoftness {
    /// Returns the softness of rigid constraints in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        let value = Softness::rigid(method).value();
        Self { method, structural: value, shear: value, bend: value }
    }

    /// Returns the number for a kind of constraint.
    pub(crate) fn value(self, kind: ConstraintKind) -> f32 {
        match kind {
            ConstraintKind::Structural | ConstraintKind::Tether => self.structural,
            ConstraintKind::Shear => self.shear,
            ConstraintKind::Bend => self.bend,
        }
    }

    /// Walks the key of the table.
    pub(crate) fn key(&mut self, fields: &mut Fields<'_>) {
        let [own, other] = softness_keys(self.method);
        refuse_other_softness(fields, self.method, other);
        fields.table(own, self);
    }
}

impl SceneTable for KindSoftness {
    const FORM: &'static str = "a table { structural, shear, bend }";

    fn fields(&mut self, fields: &mut Fields<'_>) {
        let range = softness_range(self.method);
        fields.number("structural", &mut self.structural, range);
        fields.number("shear", &mut self.shear, range);
        fields.number("bend", &mut self.bend, range);
    }
}

/// Returns the key for the softness of a method, and the key of the other method.
fn softness_keys(method: Method) -> [&'static str; 2] {
    match method {
        Method::Xpbd => ["compliance", "stiffness"],
        Method::Pbd => ["stiffness", "compliance"],
    }
}

fn softness_range(method: Method) -> NumberRange {
    let parameter = match method {
        Method::Xpbd => Parameter::Compliance,
        Method::Pbd => Parameter::Stiffness,
    };
    parameter.info().range
}

fn refuse_other_softness(fields: &mut Fields<'_>, method: Method, other: &'static str) {
    let [own, _] = softness_keys(method);
    let method = method.name();
    let problem = format!("does not apply to method \"{method}\" (allowed: {own})");
    // A method that is misspelt decides nothing.
    if fields.reader().is_none_or(|reader| reader.is_method_known.get()) {
        fields.refuse(other, &problem);
    } else {
        fields.get(other);
    }
}
