//! The row of `/tears`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The constraints that tore in one step. If the recorder missed earlier tears, they are included.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TearsRow {
    /// The step that shows the tears.
    pub step: u64,
    /// Indices of the constraints, in the order of tearing.
    pub constraints: Vec<u32>,
    /// "force", "stretch", "distance" or "cut" for each constraint, or "unknown". Absent if all
    /// causes are unknown.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<String>,
}
