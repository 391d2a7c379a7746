//! The JSON rows of a recording. The schemas in the file are derived from these types.

mod colliders;
mod forces;
mod outcome;
mod step;
mod topology;

pub use colliders::{
    ColliderBodyRow, ColliderDetails, ColliderRow, CollidersRow, MeshFile, SceneColliders, ShapeRow,
};
pub use forces::{AnchorForceRow, ColliderForceRow, ForcesRow};
pub use outcome::OutcomeRow;
pub use step::{EnergyRow, EventRow, ParametersRow, StatusRow, StepRow, TearsRow};
pub use topology::{BendColumns, Softness, SurfaceRow, TopologyRow, bend_state, constraint_state};
