//! The rows of `/topology` and `/surface`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::{ConstraintState, LoadHeader, PlainF32, Torn, TornConstraint, Triangle};

/// The constraints of a scene in columns. The position in a column is the constraint's index.
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
}

impl TryFrom<Columns> for TopologyRow {
    type Error = &'static str;

    fn try_from(columns: Columns) -> Result<Self, Self::Error> {
        let Columns { step, revision, a, b, rest_length, compliance, stiffness, kind, torn } =
            columns;
        let softness = match (compliance, stiffness) {
            (Some(compliance), None) => Softness::Compliance(compliance),
            (None, Some(stiffness)) => Softness::Stiffness(stiffness),
            _ => return Err("expected one column: compliance or stiffness"),
        };
        Ok(Self { step, revision, a, b, rest_length, softness, kind, torn })
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

impl TopologyRow {
    /// Returns the row of a load, with no torn constraints.
    pub fn new(header: &LoadHeader, constraints: &[ConstraintState]) -> Self {
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
        }
    }

    /// Returns the memory of the columns, in bytes.
    pub(crate) fn size_bytes(&self) -> usize {
        let (Softness::Compliance(softness) | Softness::Stiffness(softness)) = &self.softness;
        let columns = [&self.a, &self.b, &self.kind, &self.torn].map(|one| size_of_val(&one[..]));
        columns.iter().sum::<usize>()
            + size_of_val(&self.rest_length[..])
            + size_of_val(&softness[..])
    }

    /// Returns the constraints that were torn before the recording, with unknown causes.
    pub fn torn_before(&self) -> Torn {
        self.torn.iter().map(|index| TornConstraint::new(*index, None)).collect()
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

    /// Returns the triangles, or `None` if the number of indices is not a multiple of three.
    pub fn triangles(&self) -> Option<Vec<Triangle>> {
        let (corners, rest) = self.triangles.as_chunks::<3>();
        rest.is_empty()
            .then(|| corners.iter().map(|corners| Triangle { corners: *corners }).collect())
    }
}
