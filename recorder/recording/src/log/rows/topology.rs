//! The rows of `/topology` and `/surface`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_messages::{
    BendState, ConstraintState, LoadHeader, PlainF32, Torn, TornConstraint, Triangle,
};
use sim_solver::{Bend, Solver};

/// The constraints of a scene in columns, and then its bends. The position in a column is the constraint's
/// index.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Columns")]
#[schemars(!try_from)]
pub struct TopologyRow {
    /// The first step that shows this load.
    pub step: u64,
    /// Number of scene loads in this run, minus one.
    pub revision: u32,
    /// First particles.
    pub a: Vec<u32>,
    /// Second particles.
    pub b: Vec<u32>,
    /// Rest lengths in m.
    #[schemars(with = "Vec<f32>")]
    pub rest_length: Vec<PlainF32>,
    /// Compliances in m/N (method xpbd) or stiffnesses (method pbd).
    #[serde(flatten)]
    #[schemars(with = "SoftnessSchema")]
    pub softness: Softness,
    /// 0 structural, 1 shear, 2 bend, 3 tether.
    pub kind: Vec<u32>,
    /// Indices of the constraints that were torn before the first snapshot of the file, in the order
    /// of tearing.
    pub torn: Vec<u32>,
    /// The bends. Empty in recordings of format 5 and earlier.
    pub bends: Box<BendColumns>,
}

/// The bends of a scene in columns: [`BendState`]s. They have their own indices, and never tear.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BendColumns {
    /// Four particle indices per bend. The fourth of a bend of three is its second one again.
    pub particles: Vec<u32>,
    /// Four coefficients per bend; the fourth of a bend of three is 0.
    #[schemars(with = "Vec<f32>")]
    pub coefficients: Vec<PlainF32>,
    /// Compliances times rigidities: m^2 on a surface, m^3 on a line.
    #[schemars(with = "Vec<f32>")]
    pub geometry: Vec<PlainF32>,
    /// Bending rigidities of the scene: N m on a surface, N m^2 on a line.
    #[schemars(with = "Vec<f32>")]
    pub rigidity: Vec<PlainF32>,
    /// Values at rest in m. Other than 0 only for hinges that are folded at rest.
    #[schemars(with = "Vec<f32>")]
    pub rest: Vec<PlainF32>,
    /// 0 three particles on a line, 1 the corners of a cell, 2 a hinge of two triangles.
    pub shape: Vec<u32>,
    /// Indices of the `[[generate]]` blocks that they come from; -1 for explicit bends.
    pub block: Vec<i32>,
}

/// The column of [`TopologyRow`] whose name depends on the method.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Softness {
    /// Method xpbd, in m/N.
    Compliance(Vec<PlainF32>),
    /// Method pbd, 0..=1.
    Stiffness(Vec<PlainF32>),
}

/// The columns as they are read. A flattened enum would keep every number in 32 bytes meanwhile.
#[derive(Deserialize)]
struct Columns {
    step: u64,
    revision: u32,
    a: Vec<u32>,
    b: Vec<u32>,
    rest_length: Vec<PlainF32>,
    compliance: Option<Vec<PlainF32>>,
    stiffness: Option<Vec<PlainF32>>,
    kind: Vec<u32>,
    torn: Vec<u32>,
    #[serde(default)]
    bends: Box<BendColumns>,
}

impl TryFrom<Columns> for TopologyRow {
    type Error = &'static str;

    fn try_from(columns: Columns) -> Result<Self, Self::Error> {
        let Columns { step, revision, a, b, rest_length, compliance, stiffness, kind, torn, bends } =
            columns;
        let softness = match (compliance, stiffness) {
            (Some(compliance), None) => Softness::Compliance(compliance),
            (None, Some(stiffness)) => Softness::Stiffness(stiffness),
            _ => return Err("expected one column: compliance or stiffness"),
        };
        Ok(Self { step, revision, a, b, rest_length, softness, kind, torn, bends })
    }
}

#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct SoftnessSchema {
    #[schemars(skip_serializing_if = "Option::is_none")]
    compliance: Option<Vec<f32>>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    stiffness: Option<Vec<f32>>,
}

/// Returns a constraint as it is published.
pub fn constraint_state(constraint: sim_solver::Constraint) -> ConstraintState {
    let sim_solver::Constraint { a, b, rest_length, compliance, kind, .. } = constraint;
    ConstraintState { a, b, rest_length, compliance, kind: kind as u32 }
}

/// Returns a bend as it is published.
pub fn bend_state(bend: Bend) -> BendState {
    let Bend { particles, coefficients, geometry, rigidity, shape, block } = bend;
    BendState {
        particles,
        coefficients,
        geometry,
        rigidity,
        rest: shape.rest(),
        shape: shape.number(),
        block: block.and_then(|block| i32::try_from(block).ok()).unwrap_or(-1),
    }
}

impl TopologyRow {
    /// Returns the row of a load, with no torn constraints.
    pub fn new(header: &LoadHeader, constraints: &[ConstraintState], bends: &[BendState]) -> Self {
        let softness = constraints.iter().map(|c| PlainF32(c.compliance)).collect();
        Self {
            step: header.step,
            revision: header.topology_revision,
            a: constraints.iter().map(|c| c.a).collect(),
            b: constraints.iter().map(|c| c.b).collect(),
            rest_length: constraints.iter().map(|c| PlainF32(c.rest_length)).collect(),
            softness: match header.method {
                0 => Softness::Compliance(softness),
                _ => Softness::Stiffness(softness),
            },
            kind: constraints.iter().map(|c| c.kind).collect(),
            torn: Vec::new(),
            bends: Box::new(BendColumns::new(bends)),
        }
    }

    /// Returns the row of a load, with the elements of a solver and no torn constraints.
    pub(crate) fn of_solver(header: &LoadHeader, solver: &Solver) -> Self {
        let constraints: Vec<_> = solver.constraints().map(constraint_state).collect();
        let bends: Vec<_> = solver.bends().map(bend_state).collect();
        Self::new(header, &constraints, &bends)
    }

    /// Returns the memory of the columns, in bytes.
    pub(crate) fn size_bytes(&self) -> usize {
        let (Softness::Compliance(softness) | Softness::Stiffness(softness)) = &self.softness;
        let columns = [&self.a, &self.b, &self.kind, &self.torn].map(|one| size_of_val(&one[..]));
        columns.iter().sum::<usize>()
            + size_of_val(&self.rest_length[..])
            + size_of_val(&softness[..])
            + self.bends.size_bytes()
    }

    /// Returns the constraints that were torn before the recording, with unknown causes.
    pub fn torn_before(&self) -> Torn {
        self.torn.iter().map(|index| TornConstraint::new(*index, None)).collect()
    }

    /// Returns the bends, or `None` if their columns differ in length.
    pub fn bends(&self) -> Option<Vec<BendState>> {
        self.bends.rows()
    }

    /// Returns the constraints, or `None` if the columns differ in length.
    pub fn constraints(&self) -> Option<Vec<ConstraintState>> {
        let (Softness::Compliance(softness) | Softness::Stiffness(softness)) = &self.softness;
        let count = self.a.len();
        let lengths = [self.b.len(), self.rest_length.len(), softness.len(), self.kind.len()];
        if lengths.iter().any(|length| *length != count) {
            return None;
        }
        let constraint = |index: usize| ConstraintState {
            a: self.a[index],
            b: self.b[index],
            rest_length: self.rest_length[index].0,
            compliance: softness[index].0,
            kind: self.kind[index],
        };
        Some((0..count).map(constraint).collect())
    }
}

impl BendColumns {
    fn new(bends: &[BendState]) -> Self {
        let column = |value: fn(&BendState) -> f32| bends.iter().map(value).map(PlainF32).collect();
        Self {
            particles: bends.iter().flat_map(|one| one.particles).collect(),
            coefficients: bends.iter().flat_map(|one| one.coefficients).map(PlainF32).collect(),
            geometry: column(|one| one.geometry),
            rigidity: column(|one| one.rigidity),
            rest: column(|one| one.rest),
            shape: bends.iter().map(|one| one.shape).collect(),
            block: bends.iter().map(|one| one.block).collect(),
        }
    }

    fn size_bytes(&self) -> usize {
        let numbers = [&self.coefficients, &self.geometry, &self.rigidity, &self.rest];
        numbers.iter().map(|one| size_of_val(&one[..])).sum::<usize>()
            + size_of_val(&self.particles[..])
            + size_of_val(&self.shape[..])
            + size_of_val(&self.block[..])
    }

    fn rows(&self) -> Option<Vec<BendState>> {
        let Self { particles, coefficients, geometry, rigidity, rest, shape, block } = self;
        let (particles, odd_particles) = particles.as_chunks::<4>();
        let (coefficients, odd_coefficients) = coefficients.as_chunks::<4>();
        let count = shape.len();
        let lengths = [
            particles.len(),
            coefficients.len(),
            geometry.len(),
            rigidity.len(),
            rest.len(),
            block.len(),
        ];
        if !odd_particles.is_empty()
            || !odd_coefficients.is_empty()
            || lengths.iter().any(|length| *length != count)
        {
            return None;
        }
        let bend = |index: usize| BendState {
            particles: particles[index],
            coefficients: coefficients[index].map(|one| one.0),
            geometry: geometry[index].0,
            rigidity: rigidity[index].0,
            rest: rest[index].0,
            shape: shape[index],
            block: block[index],
        };
        Some((0..count).map(bend).collect())
    }
}

/// The triangles of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceRow {
    /// The first step that shows this load.
    pub step: u64,
    /// Three particle indices per triangle.
    pub triangles: Vec<u32>,
}

impl SurfaceRow {
    /// Returns the row of a load.
    pub fn new(header: &LoadHeader, triangles: &[Triangle]) -> Self {
        let corners = triangles.iter().flat_map(|triangle| triangle.corners).collect();
        Self { step: header.step, triangles: corners }
    }

    /// Returns the row of a load, with the triangles of a solver.
    pub(crate) fn of_solver(header: &LoadHeader, solver: &Solver) -> Self {
        Self { step: header.step, triangles: solver.triangles().as_flattened().to_vec() }
    }

    /// Returns the triangles, or `None` if the number of indices is not a multiple of three.
    pub fn triangles(&self) -> Option<Vec<Triangle>> {
        let (corners, rest) = self.triangles.as_chunks::<3>();
        rest.is_empty()
            .then(|| corners.iter().map(|corners| Triangle { corners: *corners }).collect())
    }
}
