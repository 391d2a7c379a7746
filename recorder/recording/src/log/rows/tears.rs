//! The row of `/tears`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::{TearCause, TornConstraint};

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

impl TearsRow {
    /// Returns the row of constraints that tore in `step`.
    pub fn new(step: u64, torn: &[TornConstraint]) -> Self {
        let cause = |torn: &TornConstraint| torn.cause().map_or("unknown", TearCause::name);
        Self {
            step,
            constraints: torn.iter().map(|torn| torn.constraint).collect(),
            causes: torn.iter().map(|torn| cause(torn).to_owned()).collect(),
        }
    }

    /// Returns the constraints with their causes.
    pub fn torn(&self) -> impl Iterator<Item = TornConstraint> {
        let causes = self.causes.iter().map(|name| TearCause::from_name(name));
        let causes = causes.chain(std::iter::repeat(None));
        self.constraints.iter().zip(causes).map(|(one, cause)| TornConstraint::new(*one, cause))
    }
}
