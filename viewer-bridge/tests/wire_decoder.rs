//! A decoder of the binary messages, independent of the encoder.

use sim_contract::TornConstraint;
use sim_solver::scene::{ColliderMesh, ColliderMeshes};
use viewer_bridge::wire::{
    Colliders, FlaggedParticle, Forces, Format, FrameHead, Ghost, Inspected, InspectedParticle,
    KIND_VERSION, Kind, Part, Past, Percentiles, Pins, Scene, Speeds, Stamp, Statistics, Tear,
};

/// A binary message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Message {
    Scene(Box<Scene>),
    Frame(Frame),
    Tear(Tear),
    Pins(Pins),
    Statistics(Box<Statistics>),
    Colliders(Colliders),
    Forces(Forces),
    Speeds(Speeds),
    Inspected(Inspected),
    Past(Past),
    Ghost(Ghost),
    Part(Part),
}

/// A decoded frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    /// Encoding of the positions.
    pub(crate) format: Format,
    /// Everything except the positions.
    pub(crate) head: FrameHead,
    /// Lower corner of the box.
    pub(crate) lo: [f32; 3],
    /// Size of a step along each axis.
    pub(crate) scale: [f32; 3],
    /// The positions; u16 values are converted to coordinates.
    pub(crate) positions: Vec<[f32; 3]>,
    /// Particles whose position is not finite.
    pub(crate) not_finite: Vec<u32>,
}

/// The reason for which bytes are not a message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum DecodeError {
    /// The bytes end too early: the field at a byte has a size.
    TooShort { at: usize, needed: usize },
    /// Bytes follow the end of the message.
    TooLong { extra: usize },
    /// The kind or its version is unknown.
    Unknown { kind: u16, version: u16 },
    /// The JSON of a scene is invalid.
    Json(String),
}

type Result<T> = std::result::Result<T, DecodeError>;

/// Decodes one message.
pub(crate) fn decode(bytes: &[u8]) -> Result<Message> {
    let mut cursor = Cursor { rest: bytes, at: 0 };
    let (kind, version) = (cursor.u16()?, cursor.u16()?);
    let stamp = Stamp { epoch: cursor.u32()?, step: cursor.u64()? };
    let unknown = DecodeError::Unknown { kind, version };
    if version != KIND_VERSION {
        return Err(unknown);
    }
    let is = |known: Kind| kind == known as u16;
    let message = if is(Kind::Scene) {
        Message::Scene(Box::new(scene(stamp, &mut cursor)?))
    } else if is(Kind::FrameF32) {
        Message::Frame(frame(Format::F32, stamp, &mut cursor)?)
    } else if is(Kind::FrameU16) {
        Message::Frame(frame(Format::U16, stamp, &mut cursor)?)
    } else if is(Kind::Tear) {
        Message::Tear(tear(stamp, &mut cursor)?)
    } else if is(Kind::Pins) {
        Message::Pins(pins(stamp, &mut cursor)?)
    } else if is(Kind::Stats) {
        Message::Statistics(Box::new(statistics(stamp, &mut cursor)?))
    } else if is(Kind::Colliders) {
        let colliders = cursor.pods_after_count()?;
        Message::Colliders(Colliders { stamp, colliders })
    } else if is(Kind::Forces) {
        let (count, rate_hz) = (cursor.u32()?, cursor.u32()?);
        Message::Forces(Forces { stamp, rate_hz, rows: cursor.pods(count)? })
    } else if is(Kind::Speeds) {
        Message::Speeds(Speeds { stamp, speeds: cursor.pods_after_count()? })
    } else if is(Kind::Inspected) {
        Message::Inspected(inspected(stamp, &mut cursor)?)
    } else if is(Kind::Past) {
        let (count, _reserved) = (cursor.u32()? as usize, cursor.u32()?);
        Message::Past(Past { stamp, count })
    } else if is(Kind::Ghost) {
        Message::Ghost(ghost(stamp, &mut cursor)?)
    } else if is(Kind::Part) {
        Message::Part(part(stamp, &mut cursor)?)
    } else {
        return Err(unknown);
    };
    cursor.end()?;
    Ok(message)
}

fn scene(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Scene> {
    let (particles, constraints, triangles) = (cursor.u32()?, cursor.u32()?, cursor.u32()?);
    let flags = cursor.u32()?;
    let _bounds = (cursor.vector()?, cursor.vector()?);
    let (rate_hz, json_size) = (cursor.u32()?, cursor.u32()?);
    let origin = [cursor.f64()?, cursor.f64()?, cursor.f64()?];
    Ok(Scene {
        stamp,
        flags,
        rate_hz,
        origin,
        positions: cursor.pods(particles)?,
        ends: cursor.pods(constraints)?,
        rest_lengths: cursor.pods(constraints)?,
        triangles: cursor.pods(triangles)?,
        kinds: cursor.padded(constraints)?,
        text: serde_json::from_slice(&cursor.padded(json_size)?)
            .map_err(|error| DecodeError::Json(error.to_string()))?,
        collider_meshes: meshes(cursor)?,
        compliances: cursor.pods(constraints)?,
    })
}

fn meshes(cursor: &mut Cursor<'_>) -> Result<ColliderMeshes> {
    let mut meshes = ColliderMeshes::new();
    for _ in 0..cursor.u32()? {
        let (collider, vertices, triangles) = (cursor.u32()?, cursor.u32()?, cursor.u32()?);
        let mesh = ColliderMesh {
            vertices: cursor.pods(vertices)?,
            triangles: cursor.pods(triangles)?,
            // The page does not need it.
            is_solid: false,
        };
        meshes.insert(collider as usize, mesh);
    }
    Ok(meshes)
}

fn frame(format: Format, stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Frame> {
    let sim_time_s = cursor.f64()?;
    let (count, flags) = (cursor.u32()?, cursor.u32()?);
    let (lo, scale) = (cursor.vector()?, cursor.vector()?);
    let (not_finite_count, torn_count) = (cursor.u32()?, cursor.u32()?);
    let (solve_us, wake_late_us) = (cursor.f32()?, cursor.f32()?);
    let (number, _spare) = (cursor.u32()?, cursor.u32()?);
    let publish_monotonic_ns = cursor.u64()?;
    let head = FrameHead {
        stamp,
        sim_time_s,
        flags,
        torn_count,
        solve_us,
        wake_late_us,
        number,
        publish_monotonic_ns,
    };
    let coordinate = |steps: [u16; 3]| {
        std::array::from_fn(|axis| lo[axis] + scale[axis] * f32::from(steps[axis]))
    };
    let positions = match format {
        Format::F32 => cursor.pods(count)?,
        Format::U16 => cursor.pods(count)?.into_iter().map(coordinate).collect(),
    };
    cursor.pad()?;
    Ok(Frame { format, head, lo, scale, positions, not_finite: cursor.pods(not_finite_count)? })
}

fn tear(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Tear> {
    let (first, count) = (cursor.u32()?, cursor.u32()?);
    let constraints: Vec<u32> = cursor.pods(count)?;
    let torn = constraints.into_iter().zip(cursor.padded(count)?);
    let torn = torn.map(|(constraint, cause)| TornConstraint {
        constraint,
        cause: if cause == u8::MAX { u32::MAX } else { cause.into() },
    });
    Ok(Tear { stamp, first, torn: torn.collect() })
}

fn pins(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Pins> {
    let pairs: Vec<[u32; 2]> = cursor.pods_after_count()?;
    let particles = pairs.into_iter().map(|[particle, flags]| FlaggedParticle { particle, flags });
    Ok(Pins { stamp, particles: particles.collect() })
}

fn statistics(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Statistics> {
    // The fields are evaluated in the order of this list.
    let statistics = Statistics {
        stamp,
        solve_us: Percentiles { p50: cursor.f32()?, p99: cursor.f32()? },
        wake_late_us: Percentiles { p50: cursor.f32()?, p99: cursor.f32()? },
        period_us: cursor.f32()?,
        real_time_factor: cursor.f32()?,
        time_scale: cursor.f32()?,
        stretch_mean: cursor.f32()?,
        stretch_max: cursor.f32()?,
        stretch_max_constraint: cursor.u32()?,
        kinetic_j: cursor.f64()?,
        potential_j: cursor.f64()?,
        late_steps: cursor.u64()?,
        skipped_periods: cursor.u64()?,
        outcome_count: cursor.u64()?,
        rejected_count: cursor.u64()?,
        frozen_count: cursor.u32()?,
        torn_count: cursor.u32()?,
        reader_count: cursor.u32()?,
        client_count: cursor.u32()?,
        encode_us: cursor.f32()?,
        frames_per_second: cursor.f32()?,
        flags: cursor.u32()?,
    };
    let _reserved = cursor.u32()?;
    Ok(statistics)
}

fn inspected(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Inspected> {
    let (count, _reserved) = (cursor.u32()?, cursor.u32()?);
    cursor.check(count, 32)?;
    let mut particles = Vec::new();
    for _ in 0..count {
        particles.push(InspectedParticle {
            particle: cursor.u32()?,
            position: cursor.vector()?,
            velocity: cursor.vector()?,
            inverse_mass: cursor.f32()?,
        });
    }
    Ok(Inspected { stamp, particles })
}

fn ghost(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Ghost> {
    let (count, hidden_count) = (cursor.u32()?, cursor.u32()?);
    let (farthest, distance) = (cursor.u32()?, cursor.f32()?);
    let (positions, hidden) = (cursor.pods(count)?, cursor.pods(hidden_count)?);
    Ok(Ghost { stamp, farthest, distance, positions, hidden })
}

fn part(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Part> {
    let [kind, offset, size, unpacked_size, count] = cursor.pod()?;
    let bytes = cursor.padded(count)?.into();
    Ok(Part { stamp, kind, offset, size, unpacked_size, bytes })
}

/// The unread rest of a message.
struct Cursor<'a> {
    rest: &'a [u8],
    /// Place of `rest` in the message.
    at: usize,
}

impl<'a> Cursor<'a> {
    fn bytes(&mut self, size: usize) -> Result<&'a [u8]> {
        let too_short = DecodeError::TooShort { at: self.at, needed: size };
        let (bytes, rest) = self.rest.split_at_checked(size).ok_or(too_short)?;
        (self.rest, self.at) = (rest, self.at + size);
        Ok(bytes)
    }

    /// Reads a value whose bytes are those of the message, on a little-endian machine.
    fn pod<T: bytemuck::AnyBitPattern>(&mut self) -> Result<T> {
        Ok(bytemuck::pod_read_unaligned(self.bytes(size_of::<T>())?))
    }

    fn u16(&mut self) -> Result<u16> {
        self.pod()
    }

    fn u32(&mut self) -> Result<u32> {
        self.pod()
    }

    fn u64(&mut self) -> Result<u64> {
        self.pod()
    }

    fn f32(&mut self) -> Result<f32> {
        self.pod()
    }

    fn f64(&mut self) -> Result<f64> {
        self.pod()
    }

    fn vector(&mut self) -> Result<[f32; 3]> {
        self.pod()
    }

    /// Refuses a count that the message cannot hold, before memory is allocated for it.
    fn check(&self, count: u32, size: usize) -> Result<()> {
        let needed = (count as usize).saturating_mul(size);
        let is_enough = needed <= self.rest.len();
        if is_enough { Ok(()) } else { Err(DecodeError::TooShort { at: self.at, needed }) }
    }

    fn pods<T: bytemuck::AnyBitPattern>(&mut self, count: u32) -> Result<Vec<T>> {
        self.check(count, size_of::<T>())?;
        (0..count).map(|_| self.pod()).collect()
    }

    /// Reads a count, a zero, and as many values.
    fn pods_after_count<T: bytemuck::AnyBitPattern>(&mut self) -> Result<Vec<T>> {
        let (count, _reserved) = (self.u32()?, self.u32()?);
        self.pods(count)
    }

    /// Reads bytes and the zeros after them up to the next multiple of four.
    fn padded(&mut self, count: u32) -> Result<Vec<u8>> {
        let bytes = self.bytes(count as usize)?.to_vec();
        self.pad()?;
        Ok(bytes)
    }

    fn pad(&mut self) -> Result<()> {
        self.bytes(self.at.next_multiple_of(4) - self.at).map(|_| ())
    }

    fn end(&self) -> Result<()> {
        let extra = self.rest.len();
        if extra == 0 { Ok(()) } else { Err(DecodeError::TooLong { extra }) }
    }
}
