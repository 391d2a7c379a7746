//! The row of `/outcomes`.

use std::borrow::Cow;
use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::{Map, json};
use sim_messages::{
    ACTIONS, Action, Command, FieldForm, OUTCOME_FLAG_DISCONNECTED, OUTCOME_FLAG_NEW_RUN, Outcome,
    OutcomeStatus, Reason, RestoreContents,
};

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

/// The schema of a command, from the table of actions. A field can have several forms.
struct ActionSchema;

impl JsonSchema for ActionSchema {
    fn schema_name() -> Cow<'static, str> {
        "Action".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut properties = BTreeMap::from([("kind", vec![generator.subschema_for::<String>()])]);
        for field in ACTIONS.iter().flat_map(|info| info.fields) {
            let schema = schema_of(field.form, generator);
            let forms = properties.entry(field.name).or_default();
            if !forms.contains(&schema) {
                forms.push(schema);
            }
        }
        let properties = properties.into_iter().map(|(name, forms)| match &forms[..] {
            [schema] => (name.to_owned(), schema.clone().to_value()),
            forms => (name.to_owned(), json!({ "anyOf": forms })),
        });
        let properties: Map<_, _> = properties.collect();
        json_schema!({ "type": "object", "properties": properties, "required": ["kind"] })
    }
}

fn schema_of(form: FieldForm, generator: &mut SchemaGenerator) -> Schema {
    let number = generator.subschema_for::<JsonNumber>();
    let vector = generator.subschema_for::<[JsonNumber; 3]>();
    match form {
        FieldForm::Whole => generator.subschema_for::<u32>(),
        FieldForm::Long => generator.subschema_for::<u64>(),
        FieldForm::Number => number,
        FieldForm::Flag => generator.subschema_for::<bool>(),
        FieldForm::Vector => vector,
        FieldForm::Rotation => generator.subschema_for::<[JsonNumber; 4]>(),
        FieldForm::Value => json_schema!({ "anyOf": [number, vector, { "type": "null" }] }),
        FieldForm::Path => generator.subschema_for::<Vec<PathPointSchema>>(),
        FieldForm::Text
        | FieldForm::Kind
        | FieldForm::Object
        | FieldForm::Contents
        | FieldForm::Hash => generator.subschema_for::<String>(),
    }
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
