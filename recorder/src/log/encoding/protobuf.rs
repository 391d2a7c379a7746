//! The protobuf messages of a recording, which viewers draw.
//!
//! Names, numbers and types are those of the schemas that Foxglove publishes. `descriptor.rs`
//! declares the same messages for readers of a file.

use prost::Message;
use prost::encoding::{DecodeContext, WireType, decode_key, decode_varint, skip_field};
use prost_types::Timestamp;
use sim_contract::ParticleState;

/// Name of the particles' frame. `/tf` gives its position in the frame `map`.
pub const WORLD_FRAME: &str = "world";
/// Frame of a scene's origin.
pub(super) const MAP_FRAME: &str = "map";

/// `type` of a [`PackedElementField`]: u32.
const UINT32: i32 = 5;
/// `type` of a [`PackedElementField`]: f32.
const FLOAT32: i32 = 7;

/// Number of the last field, `data`.
const DATA_NUMBER: u32 = 6;
/// The key of `data`, which is length-delimited.
const DATA_KEY: u8 = 6 << 3 | 2;
/// Most bytes of a cloud beside its data. Ours have about 150.
const REST_SIZE_BYTES_MAX: usize = 1 << 12;

/// Name, offset in bytes and numeric type.
type PackedField = (&'static str, u32, i32);

/// The fields of a [`ParticleState`].
const FIELDS: [PackedField; 8] = [
    ("x", 0, FLOAT32),
    ("y", 4, FLOAT32),
    ("z", 8, FLOAT32),
    ("inverse_mass", 12, FLOAT32),
    ("vx", 16, FLOAT32),
    ("vy", 20, FLOAT32),
    ("vz", 24, FLOAT32),
    ("flags", 28, UINT32),
];

#[derive(Clone, PartialEq, Message)]
pub(super) struct Vector3 {
    #[prost(double, tag = "1")]
    pub(super) x: f64,
    #[prost(double, tag = "2")]
    pub(super) y: f64,
    #[prost(double, tag = "3")]
    pub(super) z: f64,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct Quaternion {
    #[prost(double, tag = "1")]
    pub(super) x: f64,
    #[prost(double, tag = "2")]
    pub(super) y: f64,
    #[prost(double, tag = "3")]
    pub(super) z: f64,
    #[prost(double, tag = "4")]
    pub(super) w: f64,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct Pose {
    #[prost(message, optional, tag = "1")]
    pub(super) position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    pub(super) orientation: Option<Quaternion>,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct PackedElementField {
    #[prost(string, tag = "1")]
    pub(super) name: String,
    #[prost(fixed32, tag = "2")]
    pub(super) offset: u32,
    #[prost(int32, tag = "3")]
    pub(super) r#type: i32,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct PointCloud {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    pub(super) frame_id: String,
    #[prost(message, optional, tag = "3")]
    pub(super) pose: Option<Pose>,
    #[prost(fixed32, tag = "4")]
    pub(super) point_stride: u32,
    #[prost(message, repeated, tag = "5")]
    pub(super) fields: Vec<PackedElementField>,
    #[prost(bytes = "vec", tag = "6")]
    pub(super) data: Vec<u8>,
}

#[derive(Clone, PartialEq, Message)]
pub(super) struct FrameTransform {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    pub(super) parent_frame_id: String,
    #[prost(string, tag = "3")]
    pub(super) child_frame_id: String,
    #[prost(message, optional, tag = "4")]
    pub(super) translation: Option<Vector3>,
    #[prost(message, optional, tag = "5")]
    pub(super) rotation: Option<Quaternion>,
}

const IDENTITY: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

/// Encodes snapshots as foxglove.PointCloud. Only the time and the data differ between messages.
#[derive(Debug)]
pub(super) struct PointCloudEncoder {
    /// A cloud without data.
    prefix: PointCloud,
}

impl PointCloudEncoder {
    pub(super) fn new() -> Self {
        let position = Vector3 { x: 0.0, y: 0.0, z: 0.0 };
        let fields = FIELDS.map(|(name, offset, numeric_type)| PackedElementField {
            name: name.to_owned(),
            offset,
            r#type: numeric_type,
        });
        Self {
            prefix: PointCloud {
                timestamp: None,
                frame_id: WORLD_FRAME.to_owned(),
                pose: Some(Pose { position: Some(position), orientation: Some(IDENTITY) }),
                point_stride: 32,
                fields: fields.into(),
                data: Vec::new(),
            },
        }
    }

    /// Replaces `out` with the message. `data` is the last field and is copied once.
    pub(super) fn encode(&mut self, time_ns: u64, particles: &[ParticleState], out: &mut Vec<u8>) {
        let payload: &[u8] = bytemuck::cast_slice(particles);
        self.prefix.timestamp = Some(timestamp(time_ns));
        out.clear();
        out.reserve(self.prefix.encoded_len() + 11 + payload.len());
        self.prefix.encode_raw(out);
        if !payload.is_empty() {
            out.push(DATA_KEY);
            prost::encoding::encode_varint(payload.len() as u64, out);
            out.extend_from_slice(payload);
        }
    }
}

/// Decodes the particles of a cloud that [`PointCloudEncoder`] encoded.
pub(crate) fn decode_particles(message: &[u8]) -> Result<Vec<ParticleState>, String> {
    let data = particle_bytes(message)?;
    let mut particles = vec![ParticleState::default(); data.len() / 32];
    bytemuck::cast_slice_mut(&mut particles).copy_from_slice(data);
    Ok(particles)
}

/// Returns the bytes of the particles of a cloud that [`PointCloudEncoder`] encoded: 32 for each.
pub(crate) fn particle_bytes(message: &[u8]) -> Result<&[u8], String> {
    let (rest, data) = split_data(message).ok_or("it is not a point cloud")?;
    if rest.len() > REST_SIZE_BYTES_MAX {
        let problem = "bytes beside its data (allowed: up to";
        return Err(format!("it has {} {problem} {REST_SIZE_BYTES_MAX})", rest.len()));
    }
    let cloud = PointCloud::decode(rest.as_slice()).map_err(|error| error.to_string())?;
    let fields = cloud.fields.iter().map(|f| (f.name.as_str(), f.offset, f.r#type));
    if cloud.point_stride != 32 || !fields.eq(FIELDS) {
        return Err("its points are not particle states of 32 bytes".to_owned());
    }
    if data.len() % 32 != 0 {
        return Err(format!("its data of {} bytes is not a multiple of 32 bytes", data.len()));
    }
    Ok(data)
}

/// Splits a cloud into its field `data` and the bytes of all other fields. Decoding those costs many
/// times their size.
fn split_data(message: &[u8]) -> Option<(Vec<u8>, &[u8])> {
    let (mut rest, mut data) = (Vec::new(), &[][..]);
    let mut left = message;
    while !left.is_empty() {
        let field = left;
        let (number, wire_type) = decode_key(&mut left).ok()?;
        if (number, wire_type) == (DATA_NUMBER, WireType::LengthDelimited) {
            let size = usize::try_from(decode_varint(&mut left).ok()?).ok()?;
            (data, left) = left.split_at_checked(size)?;
        } else {
            skip_field(wire_type, number, &mut left, DecodeContext::default()).ok()?;
            rest.extend_from_slice(&field[..field.len() - left.len()]);
        }
    }
    Some((rest, data))
}

/// Returns the message on `/tf`: the scene's frame is at `origin` (m) of the map, without rotation.
/// `time_ns` is the time of the step, in nanoseconds since 1970.
pub fn encode_transform(time_ns: u64, origin: [f64; 3]) -> Vec<u8> {
    let [x, y, z] = origin;
    FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: MAP_FRAME.to_owned(),
        child_frame_id: WORLD_FRAME.to_owned(),
        translation: Some(Vector3 { x, y, z }),
        rotation: Some(IDENTITY),
    }
    .encode_to_vec()
}

#[allow(clippy::cast_possible_wrap, reason = "seconds of 64-bit nanoseconds are below 2^35")]
#[allow(clippy::cast_possible_truncation, reason = "the remainder is below 10^9")]
fn timestamp(time_ns: u64) -> Timestamp {
    let second_ns = 1_000_000_000;
    Timestamp { seconds: (time_ns / second_ns) as i64, nanos: (time_ns % second_ns) as i32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn odd_particles() -> Vec<ParticleState> {
        let quiet = f32::from_bits(0x7fc0_1234);
        let signalling = f32::from_bits(0xffa0_0001);
        let odd = ParticleState {
            position: [-0.0, quiet, signalling],
            inverse_mass: f32::MIN_POSITIVE / 2.0,
            velocity: [f32::INFINITY, f32::NEG_INFINITY, 1.0e-45],
            flags: 0xdead_beef,
        };
        vec![odd, ParticleState::default(), odd]
    }

    #[test]
    fn a_cloud_decodes_to_the_encoded_bits() {
        let particles = odd_particles();
        let mut message = Vec::new();
        PointCloudEncoder::new().encode(12_000_000_034, &particles, &mut message);
        let cloud = PointCloud::decode(message.as_slice()).unwrap();
        assert_eq!(cloud.data, bytemuck::cast_slice::<_, u8>(&particles));
        assert_eq!(cloud.timestamp, Some(Timestamp { seconds: 12, nanos: 34 }));
        assert_eq!(cloud.frame_id, "world");
        assert_eq!(cloud.pose.and_then(|pose| pose.orientation).map(|q| q.w), Some(1.0));
        let read = decode_particles(&message).unwrap();
        assert_eq!(bytemuck::cast_slice::<_, u8>(&read), bytemuck::cast_slice::<_, u8>(&particles));
    }

    #[test]
    fn a_cloud_equals_the_output_of_the_generated_encoder() {
        for particles in [odd_particles(), Vec::new()] {
            let mut encoder = PointCloudEncoder::new();
            let mut message = Vec::new();
            encoder.encode(5, &particles, &mut message);
            let mut expected = encoder.prefix.clone();
            expected.data = bytemuck::cast_slice(&particles).to_vec();
            assert_eq!(message, expected.encode_to_vec());
        }
    }

    #[test]
    fn a_cloud_with_another_point_layout_is_refused() {
        let foreign = PointCloud { point_stride: 16, ..PointCloud::default() };
        assert!(decode_particles(&foreign.encode_to_vec()).is_err());
        let partial = PointCloud { data: vec![0; 33], ..PointCloudEncoder::new().prefix };
        assert!(decode_particles(&partial.encode_to_vec()).is_err());
    }
}
