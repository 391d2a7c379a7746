//! The protobuf messages that viewers draw, as far as a recording uses them.
//!
//! Names, numbers and types are those of the schemas that Foxglove publishes; `descriptor.rs`
//! declares the same for the reader of a file.

use prost::Message;
use prost_types::Timestamp;
use sim_contract::ParticleState;

/// Name of the frame that particles are in; `/tf` says where it is in the frame `map`.
pub const WORLD_FRAME: &str = "world";
/// The frame that a scene's origin is given in.
pub(crate) const MAP_FRAME: &str = "map";

/// `type` of a [`PackedElementField`]: u32.
const UINT32: i32 = 5;
/// `type` of a [`PackedElementField`]: f32.
const FLOAT32: i32 = 7;

/// The key of the last field, `data`: number 6, length-delimited.
const DATA_KEY: u8 = 6 << 3 | 2;

/// The fields of a [`ParticleState`]: name, offset in bytes, numeric type.
const FIELDS: [(&str, u32, i32); 8] = [
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
pub(crate) struct Vector3 {
    #[prost(double, tag = "1")]
    pub(crate) x: f64,
    #[prost(double, tag = "2")]
    pub(crate) y: f64,
    #[prost(double, tag = "3")]
    pub(crate) z: f64,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct Quaternion {
    #[prost(double, tag = "1")]
    pub(crate) x: f64,
    #[prost(double, tag = "2")]
    pub(crate) y: f64,
    #[prost(double, tag = "3")]
    pub(crate) z: f64,
    #[prost(double, tag = "4")]
    pub(crate) w: f64,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct Pose {
    #[prost(message, optional, tag = "1")]
    pub(crate) position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    pub(crate) orientation: Option<Quaternion>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct PackedElementField {
    #[prost(string, tag = "1")]
    pub(crate) name: String,
    #[prost(fixed32, tag = "2")]
    pub(crate) offset: u32,
    #[prost(int32, tag = "3")]
    pub(crate) r#type: i32,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct PointCloud {
    #[prost(message, optional, tag = "1")]
    pub(crate) timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    pub(crate) frame_id: String,
    #[prost(message, optional, tag = "3")]
    pub(crate) pose: Option<Pose>,
    #[prost(fixed32, tag = "4")]
    pub(crate) point_stride: u32,
    #[prost(message, repeated, tag = "5")]
    pub(crate) fields: Vec<PackedElementField>,
    #[prost(bytes = "vec", tag = "6")]
    pub(crate) data: Vec<u8>,
}

#[derive(Clone, PartialEq, Message)]
pub(crate) struct FrameTransform {
    #[prost(message, optional, tag = "1")]
    pub(crate) timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    pub(crate) parent_frame_id: String,
    #[prost(string, tag = "3")]
    pub(crate) child_frame_id: String,
    #[prost(message, optional, tag = "4")]
    pub(crate) translation: Option<Vector3>,
    #[prost(message, optional, tag = "5")]
    pub(crate) rotation: Option<Quaternion>,
}

const IDENTITY: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

/// Encodes snapshots as foxglove.PointCloud. All but the time and the data is the same each time.
#[derive(Debug)]
pub(crate) struct PointCloudEncoder {
    /// A cloud without data.
    head: PointCloud,
}

impl PointCloudEncoder {
    pub(crate) fn new() -> Self {
        let position = Vector3 { x: 0.0, y: 0.0, z: 0.0 };
        let fields = FIELDS.map(|(name, offset, numeric_type)| PackedElementField {
            name: name.to_owned(),
            offset,
            r#type: numeric_type,
        });
        Self {
            head: PointCloud {
                timestamp: None,
                frame_id: WORLD_FRAME.to_owned(),
                pose: Some(Pose { position: Some(position), orientation: Some(IDENTITY) }),
                point_stride: 32,
                fields: fields.into(),
                data: Vec::new(),
            },
        }
    }

    /// Replaces `out` by the message. `data` is the last field and is copied once.
    pub(crate) fn encode(&mut self, time_ns: u64, particles: &[ParticleState], out: &mut Vec<u8>) {
        let payload: &[u8] = bytemuck::cast_slice(particles);
        self.head.timestamp = Some(timestamp(time_ns));
        out.clear();
        out.reserve(self.head.encoded_len() + 11 + payload.len());
        self.head.encode_raw(out);
        if !payload.is_empty() {
            out.push(DATA_KEY);
            prost::encoding::encode_varint(payload.len() as u64, out);
            out.extend_from_slice(payload);
        }
    }
}

/// Reads the particles out of a cloud that [`PointCloudEncoder`] made.
pub(crate) fn decode_particles(message: &[u8]) -> Result<Vec<ParticleState>, String> {
    let cloud = PointCloud::decode(message).map_err(|error| error.to_string())?;
    let fields = cloud.fields.iter().map(|f| (f.name.as_str(), f.offset, f.r#type));
    if cloud.point_stride != 32 || !fields.eq(FIELDS) {
        return Err("its points are not particle states of 32 bytes".to_owned());
    }
    if cloud.data.len() % 32 != 0 {
        return Err(format!("{} bytes are no whole number of particles", cloud.data.len()));
    }
    let mut particles = vec![ParticleState::default(); cloud.data.len() / 32];
    bytemuck::cast_slice_mut(&mut particles).copy_from_slice(&cloud.data);
    Ok(particles)
}

/// The message on `/tf`: the scene's frame stands at `origin` (m) of the map, unturned. `time_ns`: of
/// the step, in nanoseconds since 1970.
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
    fn a_cloud_decodes_to_the_bits_that_went_in() {
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
    fn a_cloud_is_what_the_generated_encoder_would_write() {
        for particles in [odd_particles(), Vec::new()] {
            let mut encoder = PointCloudEncoder::new();
            let mut message = Vec::new();
            encoder.encode(5, &particles, &mut message);
            let mut whole = encoder.head.clone();
            whole.data = bytemuck::cast_slice(&particles).to_vec();
            assert_eq!(message, whole.encode_to_vec());
        }
    }

    #[test]
    fn a_cloud_of_other_points_is_refused() {
        let foreign = PointCloud { point_stride: 16, ..PointCloud::default() };
        assert!(decode_particles(&foreign.encode_to_vec()).is_err());
        let torn = PointCloud { data: vec![0; 33], ..PointCloudEncoder::new().head };
        assert!(decode_particles(&torn.encode_to_vec()).is_err());
    }
}
