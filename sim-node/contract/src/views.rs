//! What a client reads.

use crate::reader::SliceSample;
use crate::{
    ColliderState, CollidersHeader, ConstraintState, LoadHeader, ParticleState, SnapshotHeader,
    TearCause, TearsHeader, Triangle,
};

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

/// A constraint that tore, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TornConstraint {
    /// Its index.
    pub constraint: u32,
    /// Why it tore, where that is known.
    pub cause: Option<TearCause>,
}

/// All constraints torn since the load. Empty where nothing tore.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Torn {
    /// The step that the newest of them tore in, and how many were new in it.
    pub header: TearsHeader,
    /// The constraints, `header.count` of them, in the order of tearing.
    pub constraints: Vec<TornConstraint>,
}

impl Torn {
    /// `causes` are those of the first constraints; behind them the causes are not known.
    pub(crate) fn new(header: &TearsHeader, torn: &[u32], causes: &[u8]) -> Self {
        let cause = |place: usize| {
            causes.get(place).copied().and_then(|cause| TearCause::from_number(cause.into()))
        };
        let constraints = torn.iter().enumerate();
        let constraints = constraints.map(|(place, constraint)| TornConstraint {
            constraint: *constraint,
            cause: cause(place),
        });
        Self { header: *header, constraints: constraints.collect() }
    }
}

/// The colliders at the end of a step. Empty where the scene has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Colliders {
    /// The step at whose end they stood so: they have not changed since, if it is an older one.
    pub header: CollidersHeader,
    /// The colliders, `header.count` of them, by index.
    pub colliders: Vec<ColliderState>,
}
