//! The row of `/events`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::MemberChange;

/// A notable event in one step: a particle that froze (kind `frozen`), or a member of the lockstep that
/// joined (`joined`), left (`left`), or was dropped, because its process ended (`killed`) or because it was
/// not ready in time (`timed_out`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EventRow {
    /// The step that shows the event.
    pub step: u64,
    /// The kind of event, as one word.
    pub kind: String,
    /// The particle, if the event concerns one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particle: Option<u32>,
    /// The member of the lockstep, if the event concerns one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub client_id: Option<u64>,
    /// A description for people.
    pub text: String,
}

impl From<&MemberChange> for EventRow {
    fn from(change: &MemberChange) -> Self {
        Self {
            step: change.step,
            kind: change.kind_name().to_owned(),
            particle: None,
            client_id: Some(change.client_id),
            text: change.to_string(),
        }
    }
}
