//! The JSON rows of a recording: what is written is what is read back, and the schemas in the
//! file are derived from these types.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use sim_contract::{
    Action, Command, ConstraintState, LoadHeader, NodeStatus, Outcome, OutcomeStatus, PlainF32,
    Reason, SnapshotHeader, StatusFlags, Triangle,
};

/// The header of one recorded snapshot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct StepRow {
    /// The step that the snapshot is the state after.
    pub step: u64,
    /// Steps since the scene was last loaded, reset or restored.
    pub scene_step: u64,
    /// XXH3-64 of the particles, 16 hex digits.
    #[serde(with = "hex")]
    #[schemars(with = "String")]
    pub state_hash: u64,
    /// Counts the loads of a scene in this run.
    pub topology_revision: u32,
    /// Constraints torn since the load.
    pub torn_count: u32,
    /// Outcomes that are part of this state: those with an index below it.
    pub outcome_count: u64,
    /// How late the step began after its deadline, in nanoseconds.
    pub wake_late_ns: u64,
    /// How long the solver took, in nanoseconds.
    pub solve_ns: u64,
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
        }
    }
}

/// What became of a command: the flat command object and its fate. The rows of a recording are
/// a command file that reproduces it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OutcomeRow {
    /// The first step that shows the effect.
    pub step: u64,
    /// Number of the sender.
    pub client_id: u64,
    /// Number of the command within its sender.
    pub sequence: u64,
    /// Place in the run's log, without gaps.
    pub index: u64,
    /// The command: "kind" and its fields.
    #[serde(flatten)]
    #[schemars(with = "ActionSchema")]
    pub action: Action,
    /// "applied" or "rejected".
    pub status: String,
    /// Why it was rejected; "" if it was applied.
    pub reason: String,
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
        }
    }
}

impl OutcomeRow {
    /// Whether the command took effect.
    pub fn is_applied(&self) -> bool {
        self.status == APPLIED
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
        outcome
    }
}

/// What the schema says of a command; [`Action`] knows no schemas.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct ActionSchema {
    kind: String,
    #[schemars(default)]
    particle: Option<u32>,
    #[schemars(default)]
    target: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    over_s: Option<JsonNumber>,
    #[schemars(default)]
    count: Option<u32>,
    #[schemars(default)]
    center: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    radius: Option<JsonNumber>,
    #[schemars(default)]
    delta: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    limit: Option<JsonNumber>,
    #[schemars(default)]
    constraint: Option<u32>,
    #[schemars(default)]
    from: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    to: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    direction: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    anchor: Option<u32>,
    #[schemars(default)]
    collider: Option<u32>,
    #[schemars(default)]
    translation: Option<[JsonNumber; 3]>,
    #[schemars(default)]
    rotation: Option<[JsonNumber; 4]>,
    #[schemars(default)]
    parameter: Option<String>,
    #[schemars(default)]
    value: Option<JsonSetting>,
    #[schemars(default)]
    constraint_kind: Option<String>,
    #[schemars(default)]
    scene: Option<String>,
}

/// The schema of what a parameter is set to; nothing of it is off.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[allow(dead_code, reason = "only its schema is used")]
enum JsonSetting {
    Number(JsonNumber),
    Vector([JsonNumber; 3]),
}

/// The constraints of a scene in columns; the place in a column is the constraint's index.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TopologyRow {
    /// The first step that shows this load.
    pub step: u64,
    /// Counts the loads of a scene in this run.
    pub revision: u32,
    /// First particles.
    pub a: Vec<u32>,
    /// Second particles.
    pub b: Vec<u32>,
    /// Rest lengths in m.
    #[schemars(with = "Vec<JsonNumber>")]
    pub rest_length: Vec<PlainF32>,
    /// Compliances in m/N (method xpbd) or stiffnesses (method pbd).
    #[serde(flatten)]
    #[schemars(with = "SoftnessSchema")]
    pub softness: Softness,
    /// 0 structural, 1 shear, 2 bend, 3 tether.
    pub kind: Vec<u32>,
    /// Indices of the constraints that were torn before the first snapshot of the file, in the order
    /// of tearing.
    pub torn: Vec<u32>,
}

/// The column of [`TopologyRow`] whose name depends on the method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Softness {
    /// In m/N, of the method xpbd.
    Compliance(Vec<PlainF32>),
    /// 0..=1, of the method pbd.
    Stiffness(Vec<PlainF32>),
}

#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct SoftnessSchema {
    #[schemars(default)]
    compliance: Option<Vec<JsonNumber>>,
    #[schemars(default)]
    stiffness: Option<Vec<JsonNumber>>,
}

impl TopologyRow {
    /// The row of a load, with nothing torn.
    pub fn new(header: &LoadHeader, constraints: &[ConstraintState]) -> Self {
        let softness = constraints.iter().map(|c| PlainF32(c.compliance)).collect();
        Self {
            step: header.step,
            revision: header.topology_revision,
            a: constraints.iter().map(|c| c.a).collect(),
            b: constraints.iter().map(|c| c.b).collect(),
            rest_length: constraints.iter().map(|c| PlainF32(c.rest_length)).collect(),
            softness: match header.method {
                0 => Softness::Compliance(softness),
                _ => Softness::Stiffness(softness),
            },
            kind: constraints.iter().map(|c| c.kind).collect(),
            torn: Vec::new(),
        }
    }

    /// The constraints, or `None` if the columns differ in length.
    pub fn constraints(&self) -> Option<Vec<ConstraintState>> {
        let (Softness::Compliance(softness) | Softness::Stiffness(softness)) = &self.softness;
        let count = self.a.len();
        let lengths = [self.b.len(), self.rest_length.len(), softness.len(), self.kind.len()];
        if lengths.iter().any(|length| *length != count) {
            return None;
        }
        let constraint = |index: usize| ConstraintState {
            a: self.a[index],
            b: self.b[index],
            rest_length: self.rest_length[index].0,
            compliance: softness[index].0,
            kind: self.kind[index],
        };
        Some((0..count).map(constraint).collect())
    }
}

/// The triangles of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SurfaceRow {
    /// The first step that shows this load.
    pub step: u64,
    /// Three particle indices for each triangle, one after the other.
    pub triangles: Vec<u32>,
}

impl SurfaceRow {
    /// The row of a load.
    pub fn new(header: &LoadHeader, triangles: &[Triangle]) -> Self {
        let corners = triangles.iter().flat_map(|triangle| triangle.corners).collect();
        Self { step: header.step, triangles: corners }
    }

    /// The triangles, or `None` if an index is left over.
    pub fn triangles(&self) -> Option<Vec<Triangle>> {
        let (corners, rest) = self.triangles.as_chunks::<3>();
        rest.is_empty()
            .then(|| corners.iter().map(|corners| Triangle { corners: *corners }).collect())
    }
}

/// What tore in one step; also in those before it, where a recorder was not told at once.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TearsRow {
    /// The step that shows it.
    pub step: u64,
    /// Indices of the constraints, in the order of tearing.
    pub constraints: Vec<u32>,
    /// "force", "stretch", "distance" or "cut" for each of them; "unknown" where that is not known,
    /// and nothing at all where it is of none of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<String>,
}

/// Something remarkable in one step.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct EventRow {
    /// The step that shows it.
    pub step: u64,
    /// What it is, as a word.
    pub kind: String,
    /// The particle that it concerns, if one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particle: Option<u32>,
    /// What it is, for people.
    pub text: String,
}

/// How the node was doing; the fields are those of [`NodeStatus`]. Those with a default are not in
/// recordings of the first version of the contract.
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
            replay: status.flags & StatusFlags::REPLAY != 0,
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

/// The pace of every node before there was another.
fn real_time() -> f64 {
    1.0
}

/// The schema of a number in any JSON of ours: non-finite ones are strings.
pub(crate) struct JsonNumber;

impl JsonSchema for JsonNumber {
    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "number" }, { "enum": ["nan", "inf", "-inf"] }] })
    }
}

/// `#[serde(with = "hex")]` for a u64 as 16 lowercase hex digits in a string.
mod hex {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde asks for")]
    pub(super) fn serialize<S: Serializer>(value: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{value:016x}"))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        let text = String::deserialize(deserializer)?;
        u64::from_str_radix(&text, 16).map_err(|_| D::Error::custom("not 16 hex digits"))
    }
}
