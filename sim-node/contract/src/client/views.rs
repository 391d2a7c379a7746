//! What a client reads.

use crate::messages::collider::{ColliderState, CollidersHeader};
use crate::messages::parameters::ParametersHeader;
use crate::messages::snapshot::{ParticleState, SnapshotHeader};
use crate::messages::tears::{TearsHeader, TornConstraint};
use crate::messages::topology::{ConstraintState, LoadHeader, Triangle};
use crate::ports::reader::SliceSample;
use sim_types::ParameterValues;

/// A snapshot in shared memory: holding it keeps the memory from being reused.
#[derive(Debug)]
pub struct Snapshot(pub(crate) SliceSample<ParticleState, SnapshotHeader>);

impl Snapshot {
    /// When and of what it is.
    pub fn header(&self) -> &SnapshotHeader {
        self.0.user_header()
    }

    /// The particles, `header().particle_count` of them, by index.
    pub fn particles(&self) -> &[ParticleState] {
        self.0.payload()
    }
}

/// The constraints of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Topology {
    /// Which load it is.
    pub header: LoadHeader,
    /// The constraints, `header.count` of them, by index.
    pub constraints: Vec<ConstraintState>,
}

/// The triangles of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Which load it is.
    pub header: LoadHeader,
    /// The triangles, `header.count` of them; none if the scene has no surface.
    pub triangles: Vec<Triangle>,
}

/// The constraints torn since the load or the last reset. Empty if nothing tore.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Torn {
    /// Step of the newest tear, and number of tears in it.
    pub header: TearsHeader,
    /// The constraints, `header.count` of them, in the order of tearing.
    pub constraints: Vec<TornConstraint>,
}

/// The values of all parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parameters {
    /// First step that the values apply to.
    pub header: ParametersHeader,
    /// The values.
    pub values: ParameterValues,
}

/// The colliders at the end of a step. Empty where the scene has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Colliders {
    /// The step at whose end they stood so: they have not changed since, if it is an older one.
    pub header: CollidersHeader,
    /// The colliders, `header.count` of them, by index.
    pub colliders: Vec<ColliderState>,
}
