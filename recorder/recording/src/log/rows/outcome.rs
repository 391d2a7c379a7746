//! The row of `/outcomes`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::{
    Action, Command, OUTCOME_FLAG_DISCONNECTED, OUTCOME_FLAG_NEW_RUN, Outcome, OutcomeStatus,
    Reason, RestoreContents,
};

use super::json::JsonNumber;

/// The outcome of a command: the flat command object with its status. The rows of a recording are a
/// command file that reproduces it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OutcomeRow {
    /// The first step that shows the effect.
    pub step: u64,
    /// Id of the client that sent the command.
    pub client_id: u64,
    /// Number of the command among those of its client.
    pub sequence: u64,
    /// Number of the outcome in its run, without gaps.
    pub index: u64,
    /// The command: "kind" and its fields.
    #[serde(flatten)]
    #[schemars(with = "ActionSchema")]
    pub action: Action,
    /// "applied" or "rejected".
    pub status: String,
    /// Reason of a rejection. "" if the command was applied.
    pub reason: String,
    /// The row answers no command: the node released a particle, because the connection of the client
    /// that grabbed it has ended. Absent from other rows.
    #[serde(default, skip_serializing_if = "is_false")]
    pub disconnected: bool,
    /// The row answers a load that began another run. Absent from other rows.
    #[serde(default, skip_serializing_if = "is_false")]
    pub new_run: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_false(value: &bool) -> bool {
    !value
}

const APPLIED: &str = "applied";
const REJECTED: &str = "rejected";

impl From<&Outcome> for OutcomeRow {
    fn from(outcome: &Outcome) -> Self {
        let status = if outcome.is_applied() { APPLIED } else { REJECTED };
        Self {
            step: outcome.step,
            client_id: outcome.command.client_id,
            sequence: outcome.command.sequence,
            index: outcome.index,
            action: outcome.command.action(),
            status: status.to_owned(),
            reason: outcome.reason_name().to_owned(),
            disconnected: outcome.is_disconnection(),
            new_run: outcome.begins_run(),
        }
    }
}

impl OutcomeRow {
    /// Returns `true` if the command took effect.
    pub fn is_applied(&self) -> bool {
        self.status == APPLIED
    }

    /// Returns `true` for a command whose state is that of another step, or comes from outside.
    pub fn puts_state_in_place(&self) -> bool {
        matches!(self.action, Action::Rewind { .. } | Action::Restore { .. })
    }

    /// Returns `true` for a command that replaces the torn constraints and everything else.
    pub fn replaces_state(&self) -> bool {
        match self.action {
            Action::Reset | Action::Rewind { .. } => true,
            Action::Restore { contents, .. } => contents == RestoreContents::State,
            _ => false,
        }
    }
}

impl From<&OutcomeRow> for Outcome {
    fn from(row: &OutcomeRow) -> Self {
        let command = Command::new(row.client_id, row.sequence, row.action);
        let mut outcome = Self::new(row.index, row.step, command, Ok(()));
        if !row.is_applied() {
            outcome.status = OutcomeStatus::Rejected as u32;
            outcome.reason = Reason::from_name(&row.reason).map_or(0, |reason| reason as u32);
        }
        if row.disconnected {
            outcome.flags |= OUTCOME_FLAG_DISCONNECTED;
        }
        if row.new_run {
            outcome.flags |= OUTCOME_FLAG_NEW_RUN;
        }
        outcome
    }
}

/// The schema of a command, because [`Action`] does not depend on schemars.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct ActionSchema {
    kind: String,
    #[schemars(skip_serializing_if = "Option::is_none")]
    particle: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    force: Option<ForceSchema>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    target: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    over_s: Option<JsonNumber>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    count: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    center: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    radius: Option<JsonNumber>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    delta: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    limit: Option<JsonNumber>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    constraint: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    from: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    to: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    direction: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    anchor: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    collider: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    translation: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    rotation: Option<[JsonNumber; 4]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    velocity: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    angular_velocity: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    torque: Option<[JsonNumber; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    parameter: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    value: Option<ParameterValueSchema>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    constraint_kind: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    block: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    scene: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    to_step: Option<u64>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    back_steps: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    contents: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    state_hash: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    object: Option<String>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    object_index: Option<u32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    path: Option<Vec<PathPointSchema>>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    append: Option<bool>,
}

/// The schema of a point of a path.
#[derive(JsonSchema)]
#[schemars(rename = "PathPoint")]
#[allow(dead_code, reason = "only its schema is used")]
struct PathPointSchema {
    time: JsonNumber,
    translation: [JsonNumber; 3],
    rotation: [JsonNumber; 4],
}

/// The schema of `force`: of a release, or on a body.
#[derive(JsonSchema)]
#[schemars(untagged, rename = "Force")]
#[allow(dead_code, reason = "only its schema is used")]
enum ForceSchema {
    Release(bool),
    Body([JsonNumber; 3]),
}

/// The schema of a parameter's value. No value means off.
#[derive(JsonSchema)]
#[schemars(untagged, rename = "ParameterValue")]
#[allow(dead_code, reason = "only its schema is used")]
enum ParameterValueSchema {
    Number(JsonNumber),
    Vector([JsonNumber; 3]),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_has_every_field_of_a_command() {
        let schema = schemars::schema_for!(ActionSchema).to_value();
        for action in Action::samples() {
            for (field, _) in serde_json::to_value(action).unwrap().as_object().unwrap() {
                let is_known = !schema["properties"][field].is_null();
                assert!(is_known || field == "number", "{field} of {action:?}");
            }
        }
    }
}
