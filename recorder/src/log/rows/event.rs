//! The row of `/events`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A notable event in one step.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EventRow {
    /// The step that shows the event.
    pub step: u64,
    /// The kind of event, as one word.
    pub kind: String,
    /// The particle, if the event concerns one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particle: Option<u32>,
    /// A description for people.
    pub text: String,
}
