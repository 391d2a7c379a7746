//! The rows of a step: its header, tears, parameters and events, and the status of the node.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::Map;
use sim_messages::{
    ConstraintKind, MemberChange, NodeStatus, OffMeaning, PARAMETERS, ParameterInfo,
    ParameterValues, Parts, SnapshotHeader, TearCause, TornConstraint, ValueForm,
};
use sim_solver::Energy;

/// The header of a recorded snapshot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepRow {
    /// The snapshot is the state after this step.
    pub step: u64,
    /// Steps since the scene was last loaded, reset or restored.
    pub scene_step: u64,
    /// XXH3-64 of the particles, as 16 hex digits.
    #[serde(with = "sim_messages::json_hash")]
    #[schemars(with = "String")]
    pub state_hash: u64,
    /// Number of scene loads in this run, minus one.
    pub topology_revision: u32,
    /// Number of torn constraints.
    pub torn_count: u32,
    /// Outcomes that this state includes: those with a lower index.
    pub outcome_count: u64,
    /// Delay of the step after its deadline, in nanoseconds.
    pub wake_late_ns: u64,
    /// Computing time of the solver, in nanoseconds.
    pub solve_ns: u64,
    /// Number of snapshots that the run has published before this one, modulo 2^32. Numbers that are
    /// left out are missing snapshots.
    pub snapshot_index: u32,
    /// Energy of the state. Absent where it was not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyRow>,
}

impl From<&SnapshotHeader> for StepRow {
    fn from(header: &SnapshotHeader) -> Self {
        Self {
            step: header.step,
            scene_step: header.scene_step,
            state_hash: header.state_hash,
            topology_revision: header.topology_revision,
            torn_count: header.torn_count,
            outcome_count: header.outcome_count,
            wake_late_ns: header.wake_late_ns,
            solve_ns: header.solve_ns,
            snapshot_index: header.snapshot_index,
            energy: None,
        }
    }
}

/// The mechanical energy of a state in J, if the scene is in metres.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnergyRow {
    /// Of the free particles.
    pub kinetic: f64,
    /// Of the free particles in gravity: the sum of -m g.x, with x from the origin of the scene.
    pub potential: f64,
    /// Of the constraints and bends that are not torn.
    pub elastic: f64,
}

impl EnergyRow {
    /// Returns the sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential + self.elastic
    }
}

impl From<Energy> for EnergyRow {
    fn from(Energy { kinetic, potential, elastic }: Energy) -> Self {
        Self { kinetic, potential, elastic }
    }
}

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

/// The status of the node, with the fields of [`NodeStatus`]. Recordings of contract version 1 lack
/// the fields with a default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "documented at the fields of NodeStatus")]
pub struct StatusRow {
    pub step: u64,
    pub paused: bool,
    pub replay: bool,
    pub real_time_factor: f64,
    #[serde(default = "real_time")]
    pub time_scale: f64,
    pub wake_late_ns_p50: u64,
    pub wake_late_ns_p99: u64,
    pub solve_ns_p50: u64,
    pub solve_ns_p99: u64,
    pub late_steps: u64,
    pub skipped_periods: u64,
    pub outcome_count: u64,
    pub rejected_count: u64,
    #[serde(default)]
    pub frozen_count: u64,
    #[serde(default)]
    pub standing_body_steps: u64,
    pub rate_hz: u32,
    pub particle_count: u32,
    pub constraint_count: u32,
    #[serde(default)]
    pub torn_count: u32,
    pub reader_count: u32,
    pub process_id: u32,
    pub scene_name: String,
}

impl From<&NodeStatus> for StatusRow {
    fn from(status: &NodeStatus) -> Self {
        let finite = |number: f64| if number.is_finite() { number } else { 0.0 };
        Self {
            step: status.step,
            paused: status.is_paused(),
            replay: status.is_replay(),
            real_time_factor: finite(status.real_time_factor),
            time_scale: finite(status.time_scale),
            wake_late_ns_p50: status.wake_late_ns_p50,
            wake_late_ns_p99: status.wake_late_ns_p99,
            solve_ns_p50: status.solve_ns_p50,
            solve_ns_p99: status.solve_ns_p99,
            late_steps: status.late_steps,
            skipped_periods: status.skipped_periods,
            outcome_count: status.outcome_count,
            rejected_count: status.rejected_count,
            frozen_count: status.frozen_count,
            standing_body_steps: status.standing_body_steps,
            rate_hz: status.rate_hz,
            particle_count: status.particle_count,
            constraint_count: status.constraint_count,
            torn_count: status.torn_count,
            reader_count: status.reader_count,
            process_id: status.process_id,
            scene_name: status.scene_name(),
        }
    }
}

/// The pace of a node of contract version 1, which had no time scale.
fn real_time() -> f64 {
    1.0
}

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

/// The values of all parameters, at the start and after each change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParametersRow {
    /// The first step with these values. They apply until the next row.
    pub step: u64,
    /// The values, named as in commands. `null` means off.
    #[serde(flatten)]
    #[schemars(with = "ValuesSchema")]
    pub values: ParameterValues,
}

/// The schema of the values, from the table of parameters.
struct ValuesSchema;

impl JsonSchema for ValuesSchema {
    fn schema_name() -> Cow<'static, str> {
        "ParameterValues".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let number = generator.subschema_for::<f32>();
        let optional = generator.subschema_for::<Option<f32>>();
        let kinds = ConstraintKind::ALL.map(|kind| (kind.name().to_owned(), optional.clone()));
        let kinds = object(kinds.into());
        let of_parameter = |info: &ParameterInfo| {
            let schema = match (info.parts, info.form, info.off) {
                (Parts::Colliders, ..) => return None,
                (Parts::Kinds, ..) => kinds.clone(),
                (_, ValueForm::Vector, _) => generator.subschema_for::<[f32; 3]>(),
                (_, ValueForm::Whole, _) => generator.subschema_for::<u32>(),
                (_, _, OffMeaning::NotAllowed | OffMeaning::Zero) => number.clone(),
                _ => optional.clone(),
            };
            Some((info.name.to_owned(), schema))
        };
        let mut properties: Vec<_> = PARAMETERS.iter().filter_map(of_parameter).collect();
        let blocks = generator.subschema_for::<Vec<BlockValueSchema>>();
        properties.push(("bending_by_block".to_owned(), blocks));
        object(properties)
    }
}

/// An object with all these properties.
fn object(properties: Vec<(String, Schema)>) -> Schema {
    let names: Vec<_> = properties.iter().map(|(name, _)| name.clone()).collect();
    let properties: Map<_, _> =
        properties.into_iter().map(|(name, schema)| (name, schema.to_value())).collect();
    json_schema!({ "type": "object", "properties": properties, "required": names })
}

/// The schema of a value for one generated block.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct BlockValueSchema {
    block: u32,
    value: f32,
}

#[cfg(test)]
mod parameters_tests {
    use sim_messages::{BlockValue, Parameter};

    use super::*;

    #[test]
    fn parameters_survive_a_round_trip_through_json_bit_for_bit() {
        let mut values = ParameterValues::default()
            .with(Parameter::Gravity, [0.1, -9.81, 1e-40])
            .with(Parameter::TearForce, 0.3)
            .with(Parameter::MaxSpeed, f32::INFINITY);
        values.bending_by_block.push(BlockValue { block: 3, value: 0.1 });
        let row = ParametersRow { step: 12, values };
        let text = serde_json::to_string(&row).unwrap();
        assert!(
            text.starts_with(r#"{"step":12,"gravity":[0.1,-9.81,1e-40],"damping":0.0"#),
            "{text}"
        );
        assert!(
            text.contains(r#""tear_distance":null,"tear_force":0.3,"max_speed":"inf""#),
            "{text}"
        );
        assert!(
            text.ends_with(r#""bending":null,"bending_by_block":[{"block":3,"value":0.1}]}"#),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<ParametersRow>(&text).unwrap(), row);
    }
}
