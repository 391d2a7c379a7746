//! The encoding and the schema of each topic, for files and for servers that send the same messages.

mod descriptor;
mod particle_buffer;
pub(crate) mod protobuf;
pub(crate) mod scene_messages;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::Serialize;
use serde_json::{Map, Value};
use sim_messages::ParticleState;

use super::message::Message;
use super::rows::{
    CollidersRow, EventRow, ForcesRow, OutcomeRow, ParametersRow, StatusRow, StepRow, SurfaceRow,
    TearsRow, TopologyRow,
};
use super::topic::Topic;
use descriptor::{FRAME_TRANSFORM, KEYFRAME, POINT_CLOUD, SCENE_UPDATE, file_descriptor_set};
pub use particle_buffer::ParticleBuffer;
pub use protobuf::{MAP_FRAME, WORLD_FRAME, encode_transform, map_from_world};
pub(super) use protobuf::{decode_keyframe, decode_particles, particle_bytes};
use protobuf::{encode_cloud_head, encode_keyframe};

/// The encoding of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicFormat {
    /// "json" or "protobuf".
    pub encoding: &'static str,
    /// The schema of the messages.
    pub schema: TopicSchema,
}

/// The schema of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicSchema {
    /// Name of the type.
    pub name: &'static str,
    /// "jsonschema" or "protobuf".
    pub encoding: &'static str,
    /// A JSON schema, or an encoded `FileDescriptorSet`.
    pub data: Vec<u8>,
}

impl TopicFormat {
    /// Returns the format of a topic.
    pub fn for_topic(topic: Topic) -> Self {
        match topic {
            Topic::Topology => json_format::<TopologyRow>("catenary.Topology"),
            Topic::Surface => json_format::<SurfaceRow>("catenary.Surface"),
            Topic::Colliders => json_format::<CollidersRow>("catenary.Colliders"),
            Topic::Tears => json_format::<TearsRow>("catenary.Tears"),
            Topic::Parameters => json_format::<ParametersRow>("catenary.Parameters"),
            Topic::Forces => json_format::<ForcesRow>("catenary.Forces"),
            Topic::Outcomes => json_format::<OutcomeRow>("catenary.Outcome"),
            Topic::Status => json_format::<StatusRow>("catenary.Status"),
            Topic::Events => json_format::<EventRow>("catenary.Event"),
            Topic::Steps => json_format::<StepRow>("catenary.Step"),
            Topic::Keyframe => protobuf_format(KEYFRAME),
            Topic::Tf => protobuf_format(FRAME_TRANSFORM),
            Topic::Particles => protobuf_format(POINT_CLOUD),
        }
    }
}

/// Returns the format of `/scene`, a topic that viewers draw and recordings lack.
pub fn scene_format() -> TopicFormat {
    protobuf_format(SCENE_UPDATE)
}

fn json_format<T: JsonSchema>(name: &'static str) -> TopicFormat {
    let data = row_schema::<T>().to_string().into_bytes();
    TopicFormat { encoding: "json", schema: TopicSchema { name, encoding: "jsonschema", data } }
}

fn protobuf_format(name: &'static str) -> TopicFormat {
    let data = file_descriptor_set(name);
    TopicFormat { encoding: "protobuf", schema: TopicSchema { name, encoding: "protobuf", data } }
}

/// Encodes messages one by one and reuses its memory.
#[derive(Debug, Default)]
pub struct MessageEncoder {
    /// The message that was encoded last.
    scratch: Vec<u8>,
}

impl MessageEncoder {
    /// Returns the bytes of a message. `time_ns` is the time of its step, in nanoseconds since
    /// 1970.
    ///
    /// # Errors
    /// Never in practice, because every row has a JSON form.
    pub fn encode<'a>(
        &'a mut self,
        message: &'a Message,
        time_ns: u64,
    ) -> Result<&'a [u8], serde_json::Error> {
        let scratch = &mut self.scratch;
        match message {
            Message::Topology(row) => json(row, scratch)?,
            Message::Surface(row) => json(row, scratch)?,
            Message::Colliders(row) => json(row, scratch)?,
            Message::Tears(row) => json(row, scratch)?,
            Message::Parameters(row) => json(row, scratch)?,
            Message::Forces(row) => json(row, scratch)?,
            Message::Outcome(row) => json(row, scratch)?,
            Message::Status(row) => json(row, scratch)?,
            Message::Event(row) => json(row, scratch)?,
            Message::Step(row) => json(row, scratch)?,
            Message::Keyframe { step, bytes } => encode_keyframe(*step, bytes, scratch),
            Message::Particles { particles, .. } => {
                return Ok(self.encode_particles(particles, time_ns));
            }
        }
        Ok(&self.scratch)
    }

    /// Returns the bytes of a message on `/particles` for a borrowed payload.
    pub fn encode_particles(&mut self, particles: &[ParticleState], time_ns: u64) -> &[u8] {
        encode_cloud_head(time_ns, particles, &mut self.scratch);
        self.scratch.extend_from_slice(bytemuck::cast_slice(particles));
        &self.scratch
    }
}

fn json<T: Serialize>(row: &T, scratch: &mut Vec<u8>) -> Result<(), serde_json::Error> {
    scratch.clear();
    serde_json::to_writer(scratch, row)
}

/// Returns the schema of the rows of a type, as they are written.
fn row_schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let settings = settings.with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>().to_value();
    simplify(&mut schema);
    schema
}

/// Moves the properties that viewers do not accept, in this object and those within it.
fn simplify(schema: &mut Value) {
    if let Some(items) = schema.get_mut("items") {
        simplify(items);
    }
    if schema["type"] != "object" {
        return;
    }
    let required = schema["required"].as_array().cloned().unwrap_or_default();
    let (mut accepted, mut others) = (Map::new(), Map::new());
    for (name, mut property) in schema["properties"].as_object().cloned().unwrap_or_default() {
        if !required.contains(&Value::from(name.as_str())) {
            remove_null(&mut property);
        }
        simplify(&mut property);
        if is_accepted(&property) {
            accepted.insert(name, property);
        } else {
            others.insert(format!("^{name}$"), property);
        }
    }
    schema["properties"] = accepted.into();
    if !others.is_empty() {
        schema["patternProperties"] = others.into();
    }
}

/// Removes null from the types of a property that a row leaves out instead.
fn remove_null(property: &mut Value) {
    let Some(types) = property.get_mut("type").and_then(Value::as_array_mut) else { return };
    types.retain(|one| one != "null");
    if let [one] = types.as_slice() {
        property["type"] = one.clone();
    }
}

/// Returns `true` if viewers accept a property.
fn is_accepted(property: &Value) -> bool {
    let is_plain = |schema: &Value| {
        ["boolean", "string", "number", "integer", "object"]
            .iter()
            .any(|one| schema["type"] == **one)
    };
    is_plain(property) || property["type"] == "array" && is_plain(&property["items"])
}
