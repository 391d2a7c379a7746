//! The JSON rows of a recording. The schemas in the file are derived from these types.

mod colliders;
mod event;
mod forces;
mod json;
mod outcome;
mod parameters;
pub(crate) mod scene_colliders;
mod status;
mod step;
mod tears;
mod topology;

pub use colliders::{ColliderBodyRow, ColliderDetails, ColliderRow, CollidersRow, ShapeRow};
pub use event::EventRow;
pub use forces::{AnchorForceRow, ColliderForceRow, ForcesRow};
pub use outcome::OutcomeRow;
pub use parameters::ParametersRow;
pub use scene_colliders::{MeshFile, SceneColliders};
pub use status::StatusRow;
pub use step::{EnergyRow, StepRow};
pub use tears::TearsRow;
pub use topology::{BendColumns, Softness, SurfaceRow, TopologyRow, bend_state, constraint_state};
