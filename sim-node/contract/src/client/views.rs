//! The data that a client reads.

use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::parameters::ParametersHeader;
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::topology::{ConstraintState, LoadHeader, Triangle};
use crate::ports::reader::SliceSample;
use sim_types::ParameterValues;

/// A snapshot in shared memory: holding it keeps the memory from being reused.
#[derive(Debug)]
pub struct Snapshot(pub(crate) SliceSample<ParticleState, SnapshotHeader>);

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
