//! The JSON rows of a recording. The schemas in the file are derived from these types.

mod colliders;
mod forces;
mod outcome;
mod step;
mod topology;

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

pub use colliders::{
    ColliderBodyRow, ColliderDetails, ColliderRow, CollidersRow, MeshFile, SceneColliders, ShapeRow,
};
pub use forces::{AnchorForceRow, ColliderForceRow, ForcesRow};
pub use outcome::OutcomeRow;
pub use step::{EnergyRow, EventRow, ParametersRow, StatusRow, StepRow, TearsRow};
pub use topology::{BendColumns, Softness, SurfaceRow, TopologyRow, bend_state, constraint_state};

/// The schema of a number from a command, which may be any. Those of a state are finite.
struct JsonNumber;

impl JsonSchema for JsonNumber {
    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "pattern": "^(nan|-?inf)$" })
    }
}
