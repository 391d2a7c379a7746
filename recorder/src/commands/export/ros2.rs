//! A bag of ROS 2: an MCAP file with `PointCloud2` messages, commands and forces as JSON, and the static transform

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{WriteOptions, Writer};
use recording::{MAP_FRAME, WORLD_FRAME, map_from_world};
use sim_contract::ParticleState;

use super::files::{FrameNames, WrittenFiles};
use super::snapshots::{Snapshots, new_outcomes};

const PARTICLES_TOPIC: &str = "/particles";
const TRANSFORM_TOPIC: &str = "/tf_static";
/// The rows of the topics with these names in a recording.
const OUTCOMES_TOPIC: &str = "/outcomes";
const FORCES_TOPIC: &str = "/forces";
const METADATA_NAME: &str = "metadata.yaml";
const SECOND_NS: u64 = 1_000_000_000;
/// Numbers of types in a `PointField`.
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;
/// The columns of a [`ParticleState`], four bytes each.
const FIELDS: [(&str, u8); 8] = [
    ("x", FLOAT32),
    ("y", FLOAT32),
    ("z", FLOAT32),
    ("inverse_mass", FLOAT32),
    ("vx", FLOAT32),
    ("vy", FLOAT32),
    ("vz", FLOAT32),
    ("flags", UINT32),
];
const FIELD_SIZE_BYTES: u32 = 4;
/// Late subscribers receive a static transform: keep the last one, reliable, transient local.
const TRANSFORM_QOS: &str = "- history: 1\\n  depth: 1\\n  reliability: 1\\n  durability: 1\\n  \
    deadline:\\n    sec: 9223372036\\n    nsec: 854775807\\n  lifespan:\\n    sec: 9223372036\\n    \
    nsec: 854775807\\n  liveliness: 1\\n  liveliness_lease_duration:\\n    sec: 9223372036\\n    \
    nsec: 854775807\\n  avoid_ros_namespace_conventions: false";

/// Writes the bag into `folder`.
pub(crate) fn write(
    snapshots: &Snapshots<'_>,
    folder: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let names = FrameNames::new(folder, &snapshots.run.scene_name, "mcap");
    let (path, metadata_path) = (names.index_path("mcap"), folder.join(METADATA_NAME));
    files.existing().check(&metadata_path)?;
    names.prepare(&[], files.existing())?;
    let mut counts = RowCounts::default();
    files.add_streamed(&path, |out| {
        counts = write_messages(snapshots, out)?;
        Ok(())
    })?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    files.add_whole(&metadata_path, metadata(snapshots, counts, &name).as_bytes())
}

/// Numbers of messages with rows.
#[derive(Clone, Copy, Default)]
struct RowCounts {
    outcomes: usize,
    forces: usize,
}

fn write_messages(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<RowCounts> {
    let mut file = WriteOptions::new()
        .profile("ros2")
        .library(concat!("catenary recorder ", env!("CARGO_PKG_VERSION")))
        .disable_seeking(true)
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(1)
        .compression_threads(0)
        .create(NoSeek::new(out))?;
    let transforms = add_channel(&mut file, TRANSFORM_TOPIC, &TRANSFORMS)?;
    let clouds = add_channel(&mut file, PARTICLES_TOPIC, &POINT_CLOUD)?;
    let outcomes = add_channel(&mut file, OUTCOMES_TOPIC, &STRING)?;
    let forces = add_channel(&mut file, FORCES_TOPIC, &STRING)?;
    let mut counts = RowCounts::default();
    let header = |channel_id, step: u64| {
        let time_ns = snapshots.run.time_of_step_ns(step);
        // The low half of the step, as in recordings.
        let sequence = u32::try_from(step & u64::from(u32::MAX)).unwrap_or_default();
        MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns }
    };
    let first = header(transforms, snapshots.steps[0]);
    file.write_to_known_channel(&first, &transform(snapshots, first.log_time))?;
    snapshots.for_each(|state| {
        for row in new_outcomes(state) {
            let message = text_message(&serde_json::to_string(row)?);
            file.write_to_known_channel(&header(outcomes, row.step), &message)?;
            counts.outcomes += 1;
        }
        if let Some(row) = &state.forces {
            let message = text_message(&serde_json::to_string(row)?);
            file.write_to_known_channel(&header(forces, row.step), &message)?;
            counts.forces += 1;
        }
        let header = header(clouds, state.row.step);
        let message = point_cloud(&state.particles, header.log_time);
        Ok(file.write_to_known_channel(&header, &message)?)
    })?;
    file.finish()?;
    Ok(counts)
}

/// Returns a `std_msgs/String`.
fn text_message(text: &str) -> Vec<u8> {
    let mut message = CdrMessage::new();
    message.add_text(text);
    message.finish()
}

fn add_channel<W: Write>(
    file: &mut Writer<NoSeek<W>>,
    topic: &str,
    message: &MessageType,
) -> mcap::McapResult<u16> {
    let schema_id = file.add_schema(message.name, "ros2msg", message.definition.as_bytes())?;
    file.add_channel(schema_id, topic, "cdr", &BTreeMap::new())
}

/// Adds a `std_msgs/Header`.
fn add_header(message: &mut CdrMessage, time_ns: u64, frame: &str) {
    let part = |number: u64| u32::try_from(number).unwrap_or(u32::MAX);
    // Seconds are signed and end in 2038.
    message.add_u32(part(time_ns / SECOND_NS));
    message.add_u32(part(time_ns % SECOND_NS));
    message.add_text(frame);
}

/// Returns a `sensor_msgs/PointCloud2` with the bytes of the particles.
fn point_cloud(particles: &[ParticleState], time_ns: u64) -> Vec<u8> {
    let mut message = CdrMessage::new();
    let point_step = FIELD_SIZE_BYTES * 8;
    let bytes: &[u8] = bytemuck::cast_slice(particles);
    add_header(&mut message, time_ns, WORLD_FRAME);
    message.add_u32(1);
    message.add_count(particles.len());
    message.add_count(FIELDS.len());
    for (offset, (name, number_type)) in (0..).step_by(FIELD_SIZE_BYTES as usize).zip(FIELDS) {
        message.add_text(name);
        message.add_u32(offset);
        message.add_u8(number_type);
        message.add_u32(1);
    }
    // Not big-endian.
    message.add_u8(0);
    message.add_u32(point_step);
    message.add_count(bytes.len());
    message.add_bytes(bytes);
    // Every position is finite.
    message.add_u8(1);
    message.finish()
}

/// Returns a `tf2_msgs/TFMessage` with the turn of the scene's `up` to z.
fn transform(snapshots: &Snapshots<'_>, time_ns: u64) -> Vec<u8> {
    let (translation, rotation) = map_from_world(snapshots.run.origin, snapshots.up);
    let mut message = CdrMessage::new();
    message.add_count(1);
    add_header(&mut message, time_ns, MAP_FRAME);
    message.add_text(WORLD_FRAME);
    for number in translation.into_iter().chain(rotation) {
        message.add_f64(number);
    }
    message.finish()
}

/// Returns the metadata of the bag, version 5, which later versions of rosbag2 read.
fn metadata(snapshots: &Snapshots<'_>, rows: RowCounts, file_name: &str) -> String {
    let time_ns = |step: Option<&u64>| snapshots.run.time_of_step_ns(step.copied().unwrap_or(0));
    let start_ns = time_ns(snapshots.steps.first());
    let duration_ns = time_ns(snapshots.steps.last()).saturating_sub(start_ns);
    let cloud_count = snapshots.steps.len();
    let count = cloud_count + 1 + rows.outcomes + rows.forces;
    let topic = |name: &str, message: &MessageType, qos: &str, count: usize| {
        let type_name = message.name;
        format!(
            "    - topic_metadata:\n        name: {name}\n        type: {type_name}\n        \
             serialization_format: cdr\n        offered_qos_profiles: \"{qos}\"\n      \
             message_count: {count}\n"
        )
    };
    let topics = topic(TRANSFORM_TOPIC, &TRANSFORMS, TRANSFORM_QOS, 1)
        + &topic(PARTICLES_TOPIC, &POINT_CLOUD, "", cloud_count)
        + &topic(OUTCOMES_TOPIC, &STRING, "", rows.outcomes)
        + &topic(FORCES_TOPIC, &STRING, "", rows.forces);
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    \
         nanoseconds: {duration_ns}\n  starting_time:\n    nanoseconds_since_epoch: {start_ns}\n  \
         message_count: {count}\n  topics_with_message_count:\n{topics}  compression_format: \"\"\n  \
         compression_mode: \"\"\n  relative_file_paths:\n    - \"{file_name}\"\n  files:\n    \
         - path: \"{file_name}\"\n      starting_time:\n        nanoseconds_since_epoch: {start_ns}\n      \
         duration:\n        nanoseconds: {duration_ns}\n      message_count: {count}\n"
    )
}

/// Identifies little-endian CDR. Alignment counts from its end.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// A message that is being encoded.
pub(super) struct CdrMessage(Vec<u8>);

impl CdrMessage {
    pub(super) fn new() -> Self {
        Self(ENCAPSULATION.to_vec())
    }

    pub(super) fn add_u8(&mut self, number: u8) {
        self.0.push(number);
    }

    pub(super) fn add_u32(&mut self, number: u32) {
        self.add_aligned(number.to_le_bytes());
    }

    pub(super) fn add_f64(&mut self, number: f64) {
        self.add_aligned(number.to_le_bytes());
    }

    /// Adds a text with its length and the zero at its end.
    pub(super) fn add_text(&mut self, text: &str) {
        self.add_count(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    /// Adds a list of bytes with its length.
    pub(super) fn add_bytes(&mut self, bytes: &[u8]) {
        self.add_count(bytes.len());
        self.0.extend_from_slice(bytes);
    }

    /// Adds the number of elements of a list. A payload of 2^24 particles has 2^29 bytes.
    pub(super) fn add_count(&mut self, count: usize) {
        self.add_u32(u32::try_from(count).unwrap_or(u32::MAX));
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }

    fn add_aligned<const N: usize>(&mut self, bytes: [u8; N]) {
        let content_size_bytes = self.0.len() - ENCAPSULATION.len();
        let size_bytes = content_size_bytes.next_multiple_of(N) + ENCAPSULATION.len();
        self.0.resize(size_bytes, 0);
        self.0.extend_from_slice(&bytes);
    }
}

/// Name and definition of a message.
pub(super) struct MessageType {
    pub(super) name: &'static str,
    pub(super) definition: &'static str,
}

pub(super) const POINT_CLOUD: MessageType = MessageType {
    name: "sensor_msgs/msg/PointCloud2",
    definition: "\
std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
",
};

pub(super) const STRING: MessageType =
    MessageType { name: "std_msgs/msg/String", definition: "string data\n" };

pub(super) const TRANSFORMS: MessageType = MessageType {
    name: "tf2_msgs/msg/TFMessage",
    definition: "\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
",
};

#[cfg(test)]
mod cdr_tests {
    use super::*;

    /// The example of a string before a number: padding follows it.
    #[test]
    fn numbers_are_aligned_to_their_size() {
        let mut message = CdrMessage::new();
        message.add_text("map");
        message.add_u8(7);
        message.add_u32(1);
        message.add_f64(1.0);
        let expected = [
            &[0, 1, 0, 0][..],
            &[4, 0, 0, 0, b'm', b'a', b'p', 0],
            &[7, 0, 0, 0, 1, 0, 0, 0],
            &1.0_f64.to_le_bytes(),
        ];
        assert_eq!(message.finish(), expected.concat());
    }
}
