//! The protobuf messages of a recording, which viewers draw.
//!
//! Names, numbers and types are those of the schemas that Foxglove publishes, except for the keyframe.
//! `descriptor.rs` declares the same messages for readers of a file.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::LazyLock;

use prost::Message;
use prost::encoding::{
    DecodeContext, WireType, decode_key, decode_varint, encode_key, encode_varint, skip_field,
};
use prost_types::Timestamp;
use sim_messages::ParticleState;
use sim_solver::scene::Up;

/// Name of the particles' frame. `/tf` gives its pose in the frame `map`.
pub const WORLD_FRAME: &str = "world";
/// Frame in which z points up.
pub const MAP_FRAME: &str = "map";

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

#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Vector3 {
    #[prost(double, tag = "1")]
    pub(crate) x: f64,
    #[prost(double, tag = "2")]
    pub(crate) y: f64,
    #[prost(double, tag = "3")]
    pub(crate) z: f64,
}

#[derive(Clone, Copy, PartialEq, Message)]
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

#[derive(Clone, Copy, PartialEq, Message)]
pub(crate) struct Pose {
    #[prost(message, optional, tag = "1")]
    pub(crate) position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    pub(crate) orientation: Option<Quaternion>,
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

/// The keyframe of a step in the solver's encoding.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Keyframe {
    #[prost(uint64, tag = "1")]
    pub(super) step: u64,
    #[prost(bytes = "vec", tag = "2")]
    pub(super) data: Vec<u8>,
}

const IDENTITY: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

/// Returns a cloud without a time and data.
fn empty_cloud() -> PointCloud {
    let position = Vector3 { x: 0.0, y: 0.0, z: 0.0 };
    let fields = FIELDS.map(|(name, offset, numeric_type)| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: numeric_type,
    });
    PointCloud {
        timestamp: None,
        frame_id: WORLD_FRAME.to_owned(),
        pose: Some(Pose { position: Some(position), orientation: Some(IDENTITY) }),
        point_stride: 32,
        fields: fields.into(),
        data: Vec::new(),
    }
}

/// The fields between the time and the data, which are the same in all clouds.
static SHARED_FIELDS: LazyLock<Vec<u8>> = LazyLock::new(|| empty_cloud().encode_to_vec());

/// Replaces `out` with a foxglove.PointCloud up to the bytes of its data, which is the last field.
pub(super) fn encode_cloud_head(time_ns: u64, particles: &[ParticleState], out: &mut Vec<u8>) {
    out.clear();
    prost::encoding::message::encode(1, &timestamp(time_ns), out);
    out.extend_from_slice(&SHARED_FIELDS);
    if !particles.is_empty() {
        out.push(DATA_KEY);
        encode_varint(size_of_val(particles) as u64, out);
    }
}

/// Replaces `out` with the particles of a cloud that [`encode_cloud_head`] has begun.
pub(crate) fn decode_particles(message: &[u8], out: &mut Vec<ParticleState>) -> Result<(), String> {
    let data = particle_bytes(message)?;
    out.resize(data.len() / size_of::<ParticleState>(), ParticleState::default());
    bytemuck::cast_slice_mut(out).copy_from_slice(data);
    Ok(())
}

/// Returns the bytes of the particles of a cloud that [`encode_cloud_head`] has begun: 32 for each.
pub(crate) fn particle_bytes(message: &[u8]) -> Result<&[u8], String> {
    match plain_particle_bytes(message) {
        Some(data) => Ok(data),
        None => any_particle_bytes(message),
    }
}

/// Returns the bytes of the particles if all fields are in the order of [`encode_cloud_head`].
fn plain_particle_bytes(message: &[u8]) -> Option<&[u8]> {
    let mut left = message;
    let time = take_field(1, &mut left)?;
    Timestamp::decode(time).ok()?;
    left = left.strip_prefix(SHARED_FIELDS.as_slice())?;
    let data = take_field(DATA_NUMBER, &mut left)?;
    (left.is_empty() && data.len().is_multiple_of(size_of::<ParticleState>())).then_some(data)
}

/// Removes the next field, if it has this number and bytes, and returns them.
fn take_field<'a>(number: u32, left: &mut &'a [u8]) -> Option<&'a [u8]> {
    if decode_key(left).ok()? != (number, WireType::LengthDelimited) {
        return None;
    }
    let size = usize::try_from(decode_varint(left).ok()?).ok()?;
    let (field, rest) = left.split_at_checked(size)?;
    *left = rest;
    Some(field)
}

/// Returns the bytes of the particles of a cloud with fields in any order.
fn any_particle_bytes(message: &[u8]) -> Result<&[u8], String> {
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

/// Returns the message on `/tf`, which turns the scene so that `up` becomes z, the axis that viewers
/// draw upwards. `origin` (m) is the origin of the scene in its own axes, and `time_ns` the time of the
/// step, in nanoseconds since 1970.
pub fn encode_transform(time_ns: u64, origin: [f64; 3], up: Up) -> Vec<u8> {
    FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: MAP_FRAME.to_owned(),
        child_frame_id: WORLD_FRAME.to_owned(),
        translation: Some(turned(origin, up)),
        rotation: Some(rotation_to_z(up)),
    }
    .encode_to_vec()
}

/// Returns the pose of the frame [`WORLD_FRAME`] in [`MAP_FRAME`], as in [`encode_transform`]: a translation
/// in m, and a quaternion x, y, z, w.
pub fn map_from_world(origin: [f64; 3], up: Up) -> ([f64; 3], [f64; 4]) {
    let (translation, rotation) = (turned(origin, up), rotation_to_z(up));
    let Quaternion { x, y, z, w } = rotation;
    ([translation.x, translation.y, translation.z], [x, y, z, w])
}

/// Returns the rotation that takes `up` to z: none, or a quarter turn about x.
fn rotation_to_z(up: Up) -> Quaternion {
    let quarter = |x: f64| Quaternion { x, w: FRAC_1_SQRT_2, ..Quaternion::default() };
    match up {
        Up::Y => quarter(FRAC_1_SQRT_2),
        Up::MinusY => quarter(-FRAC_1_SQRT_2),
        Up::Z => IDENTITY,
    }
}

/// Returns a vector after [`rotation_to_z`], without its rounding.
fn turned([x, y, z]: [f64; 3], up: Up) -> Vector3 {
    match up {
        // 0 - z has no minus zero.
        Up::Y => Vector3 { x, y: 0.0 - z, z: y },
        Up::MinusY => Vector3 { x, y: z, z: 0.0 - y },
        Up::Z => Vector3 { x, y, z },
    }
}

/// Replaces `out` with the message on `/keyframe`. Like a generated encoder, it leaves out a step of 0
/// and empty data.
pub(super) fn encode_keyframe(step: u64, data: &[u8], out: &mut Vec<u8>) {
    out.clear();
    out.reserve(22 + data.len());
    if step != 0 {
        prost::encoding::uint64::encode(1, &step, out);
    }
    if !data.is_empty() {
        encode_key(2, WireType::LengthDelimited, out);
        encode_varint(data.len() as u64, out);
        out.extend_from_slice(data);
    }
}

/// Decodes a message on `/keyframe` to its step and the solver's encoding.
pub(crate) fn decode_keyframe(message: &[u8]) -> Result<(u64, Vec<u8>), String> {
    let Keyframe { step, data } = Keyframe::decode(message).map_err(|error| error.to_string())?;
    Ok((step, data))
}

#[allow(clippy::cast_possible_wrap, reason = "seconds of 64-bit nanoseconds are below 2^35")]
#[allow(clippy::cast_possible_truncation, reason = "the remainder is below 10^9")]
pub(crate) fn timestamp(time_ns: u64) -> Timestamp {
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

    fn encode_cloud(time_ns: u64, particles: &[ParticleState], out: &mut Vec<u8>) {
        encode_cloud_head(time_ns, particles, out);
        out.extend_from_slice(bytemuck::cast_slice(particles));
    }

    #[test]
    fn fields_in_another_order_and_unknown_ones_change_no_particle() {
        let particles = odd_particles();
        let data = bytemuck::cast_slice::<_, u8>(&particles).to_vec();
        let cloud = PointCloud { data: data.clone(), ..PointCloud::default() }.encode_to_vec();
        let time = PointCloud { timestamp: Some(timestamp(7)), ..PointCloud::default() };
        let time = time.encode_to_vec();
        let (fields, unknown) = (SHARED_FIELDS.clone(), vec![15 << 3 | 2, 1, 0]);
        for parts in [
            [cloud.clone(), fields.clone(), time.clone()],
            [time, fields, [cloud, unknown].concat()],
        ] {
            assert_eq!(particle_bytes(&parts.concat()), Ok(data.as_slice()));
        }
    }

    #[test]
    fn a_cloud_decodes_to_the_encoded_bits() {
        let particles = odd_particles();
        let mut message = Vec::new();
        encode_cloud(12_000_000_034, &particles, &mut message);
        let cloud = PointCloud::decode(message.as_slice()).unwrap();
        assert_eq!(cloud.data, bytemuck::cast_slice::<_, u8>(&particles));
        assert_eq!(cloud.timestamp, Some(Timestamp { seconds: 12, nanos: 34 }));
        assert_eq!(cloud.frame_id, "world");
        assert_eq!(cloud.pose.and_then(|pose| pose.orientation).map(|q| q.w), Some(1.0));
        let mut read = vec![ParticleState::default(); 7];
        decode_particles(&message, &mut read).unwrap();
        assert_eq!(bytemuck::cast_slice::<_, u8>(&read), bytemuck::cast_slice::<_, u8>(&particles));
    }

    #[test]
    fn a_cloud_equals_the_output_of_the_generated_encoder() {
        for particles in [odd_particles(), Vec::new()] {
            let mut message = Vec::new();
            encode_cloud(5, &particles, &mut message);
            let timestamp = Some(Timestamp { seconds: 0, nanos: 5 });
            let data = bytemuck::cast_slice(&particles).to_vec();
            let expected = PointCloud { timestamp, data, ..empty_cloud() };
            assert_eq!(message, expected.encode_to_vec());
        }
    }

    #[test]
    fn a_keyframe_equals_the_output_of_the_generated_encoder() {
        for (step, data) in [(0, Vec::new()), (0, vec![7]), (u64::MAX, vec![0; 300])] {
            let mut message = Vec::new();
            encode_keyframe(step, &data, &mut message);
            assert_eq!(message, Keyframe { step, data: data.clone() }.encode_to_vec());
            assert_eq!(decode_keyframe(&message), Ok((step, data)));
        }
        assert!(decode_keyframe(b"\x12\x05abc").is_err());
    }

    /// Rotates a vector by a quaternion: v + 2 w (u x v) + 2 u x (u x v).
    fn rotated(q: &Quaternion, v: [f64; 3]) -> [f64; 3] {
        let u = [q.x, q.y, q.z];
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let (once, twice) = (cross(u, v), cross(u, cross(u, v)));
        std::array::from_fn(|axis| v[axis] + 2.0 * (q.w * once[axis] + twice[axis]))
    }

    #[test]
    fn the_transform_turns_up_to_z_and_the_origin_with_it() {
        for (up, axis) in
            [(Up::Y, [0.0, 1.0, 0.0]), (Up::MinusY, [0.0, -1.0, 0.0]), (Up::Z, [0.0, 0.0, 1.0])]
        {
            let origin = [1.0, 20.0, -300.0];
            let message = encode_transform(0, origin, up);
            let transform = FrameTransform::decode(message.as_slice()).unwrap();
            let frames = [transform.parent_frame_id.as_str(), transform.child_frame_id.as_str()];
            assert_eq!(frames, ["map", "world"]);
            let rotation = transform.rotation.unwrap();
            let Vector3 { x, y, z } = transform.translation.unwrap();
            for (found, expected) in [
                (rotated(&rotation, axis), [0.0, 0.0, 1.0]),
                // The turn keeps x, so nothing is mirrored.
                (rotated(&rotation, [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]),
                ([x, y, z], rotated(&rotation, origin)),
            ] {
                let error = |axis: usize| (found[axis] - expected[axis]).abs();
                assert!((0..3).all(|axis| error(axis) < 1e-12), "{up:?}: {found:?}");
            }
        }
    }

    #[test]
    fn a_cloud_with_another_point_layout_is_refused() {
        let foreign = PointCloud { point_stride: 16, ..PointCloud::default() };
        assert!(decode_particles(&foreign.encode_to_vec(), &mut Vec::new()).is_err());
        let partial = PointCloud { data: vec![0; 33], ..empty_cloud() };
        assert!(decode_particles(&partial.encode_to_vec(), &mut Vec::new()).is_err());
    }
}
