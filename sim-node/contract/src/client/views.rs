//! The data that a client reads.

use sim_messages::{
    BendState, ColliderState, CollidersHeader, ConstraintState, ForceKind, ForceRow, ForcesHeader,
    LoadHeader, ParameterValues, ParametersHeader, ParticleState, SnapshotHeader, Triangle,
};

use crate::ports::reader::Sample;

/// A snapshot in shared memory: holding it keeps the memory from being reused.
#[derive(Debug)]
pub struct Snapshot(pub(crate) Sample<ParticleState, SnapshotHeader>);

impl Snapshot {
    /// Returns the header.
    pub fn header(&self) -> &SnapshotHeader {
        self.0.user_header()
    }

    /// Returns the `header().particle_count` particles, by index.
    pub fn particles(&self) -> &[ParticleState] {
        self.0.payload()
    }
}

/// The constraints of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Topology {
    /// Header of the load.
    pub header: LoadHeader,
    /// The `header.count` constraints, by index.
    pub constraints: Vec<ConstraintState>,
}

/// The bends of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Bends {
    /// Header of the load.
    pub header: LoadHeader,
    /// The `header.count` bends, by index; empty if the scene has none.
    pub bends: Vec<BendState>,
}

/// The triangles of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Header of the load.
    pub header: LoadHeader,
    /// The `header.count` triangles; empty if the scene has no surface.
    pub triangles: Vec<Triangle>,
}

/// The values of all parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parameters {
    /// Header of the values: the first step that they apply to.
    pub header: ParametersHeader,
    /// The values.
    pub values: ParameterValues,
}

/// The colliders at the end of a step. Empty if the scene has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Colliders {
    /// Header of the list: the step at whose end the colliders had these poses. They have not changed
    /// since.
    pub header: CollidersHeader,
    /// The `header.count` colliders, by index.
    pub colliders: Vec<ColliderState>,
}

/// The impulses of a step on colliders, anchors and fixed particles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forces {
    /// Header of the rows: the step, and its rate.
    pub header: ForcesHeader,
    /// The `header.count` rows: of each collider, then of each anchor, then of each pinned, grabbed or
    /// anchored particle.
    pub rows: Vec<ForceRow>,
}

impl Forces {
    /// Returns the rows of a kind, by index.
    pub fn of_kind(&self, kind: ForceKind) -> impl Iterator<Item = &ForceRow> {
        self.rows.iter().filter(move |row| row.kind() == Some(kind))
    }

    /// Returns the row of a collider, anchor or particle; `None` for a particle that is free.
    pub fn row(&self, kind: ForceKind, index: u32) -> Option<&ForceRow> {
        self.of_kind(kind).find(|row| row.index == index)
    }

    /// Returns the force of a row in N: its impulse over the time of the step.
    pub fn force(&self, row: &ForceRow) -> [f64; 3] {
        row.impulse.map(|axis| f64::from(axis) * f64::from(self.header.rate_hz))
    }

    /// Returns the torque of a row in N m, about the center of the collider or anchor.
    pub fn torque(&self, row: &ForceRow) -> [f64; 3] {
        row.angular_impulse.map(|axis| f64::from(axis) * f64::from(self.header.rate_hz))
    }
}
