//! SCENE: what does not change until the next load.

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use sim_contract::{ConstraintState, ParticleState, Triangle};

use super::cursor::Cursor;
use super::frame::bounds;
use super::{DecodeError, Kind, Stamp, Writer, count_of};

/// The bits of a scene's flags.
pub mod scene_flag {
    /// Two dimensions: z is 0.
    pub const PLANAR: u32 = 1;
    /// Constraints tear by themselves.
    pub const TEARABLE: u32 = 1 << 1;
    /// It has generated tethers.
    pub const TETHERS: u32 = 1 << 2;
    /// Constraints have a stiffness, not a compliance.
    pub const PBD: u32 = 1 << 3;
}

/// A load with the positions of its first snapshot.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Load and step.
    pub stamp: Stamp,
    /// [`scene_flag`] bits.
    pub flags: u32,
    /// Steps per second.
    pub rate_hz: u32,
    /// What positions are relative to.
    pub origin: [f64; 3],
    /// Positions at the step of the stamp.
    pub positions: Vec<[f32; 3]>,
    /// Ends of the constraints.
    pub ends: Vec<[u32; 2]>,
    /// Rest lengths of the constraints.
    pub rest_lengths: Vec<f32>,
    /// Corners of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Kinds of the constraints.
    pub kinds: Vec<u8>,
    /// Names, and what is rare.
    pub text: SceneText,
}

/// The JSON of a scene.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneText {
    /// Name of the scene.
    pub name: String,
    /// Unit of lengths.
    pub unit: String,
    /// "y", "-y" or "z".
    pub up: String,
    /// 16 hexadecimal digits.
    pub run_id: String,
    /// Particles that form sheets.
    pub grids: Vec<Grid>,
}

/// A sheet: particle `first + row * columns + column`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grid {
    /// Its first particle.
    pub first: u32,
    /// Particles of a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
}

impl Scene {
    /// Takes over what the node publishes; positions that are not finite become 0.
    pub fn set_geometry(
        &mut self,
        particles: &[ParticleState],
        constraints: &[ConstraintState],
        triangles: &[Triangle],
    ) {
        let finite = |axis: f32| if axis.is_finite() { axis } else { 0.0 };
        self.positions = particles.iter().map(|one| one.position.map(finite)).collect();
        self.ends = constraints.iter().map(|one| [one.a, one.b]).collect();
        self.rest_lengths = constraints.iter().map(|one| one.rest_length).collect();
        self.kinds =
            constraints.iter().map(|one| u8::try_from(one.kind).unwrap_or(u8::MAX)).collect();
        self.triangles = triangles.iter().map(|one| one.corners).collect();
    }

    /// The box around the positions.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let particle =
            |position: &[f32; 3]| ParticleState { position: *position, ..ParticleState::default() };
        let particles: Vec<_> = self.positions.iter().map(particle).collect();
        let (min, max, _) = bounds(&particles);
        (min, max)
    }

    /// As bytes.
    pub fn encode(&self) -> Bytes {
        let json = serde_json::to_vec(&self.text).unwrap_or_default();
        let size = 96
            + 12 * self.positions.len()
            + 13 * self.ends.len()
            + 12 * self.triangles.len()
            + json.len();
        let (min, max) = self.bounds();
        let mut writer = Writer::new(Kind::Scene, self.stamp, size);
        writer.u32(count_of(&self.positions));
        writer.u32(count_of(&self.ends));
        writer.u32(count_of(&self.triangles));
        writer.u32(self.flags);
        writer.vector(min);
        writer.vector(max);
        writer.u32(self.rate_hz);
        writer.u32(count_of(&json));
        self.origin.iter().for_each(|axis| writer.f64(*axis));
        self.positions.iter().for_each(|position| writer.vector(*position));
        self.ends.iter().flatten().for_each(|end| writer.u32(*end));
        self.rest_lengths.iter().for_each(|length| writer.f32(*length));
        self.triangles.iter().flatten().for_each(|corner| writer.u32(*corner));
        writer.put(&self.kinds);
        writer.pad();
        writer.put(&json);
        writer.pad();
        writer.finish()
    }

    pub(super) fn decode(stamp: Stamp, cursor: &mut Cursor<'_>) -> Result<Self, DecodeError> {
        let (particles, constraints, triangles) = (cursor.u32()?, cursor.u32()?, cursor.u32()?);
        let flags = cursor.u32()?;
        let _bounds = (cursor.vector()?, cursor.vector()?);
        let (rate_hz, json_size) = (cursor.u32()?, cursor.u32()?);
        let origin = [cursor.f64()?, cursor.f64()?, cursor.f64()?];
        Ok(Self {
            stamp,
            flags,
            rate_hz,
            origin,
            positions: cursor.list(particles, 12, Cursor::vector)?,
            ends: cursor.list(constraints, 8, |cursor| Ok([cursor.u32()?, cursor.u32()?]))?,
            rest_lengths: cursor.list(constraints, 4, Cursor::f32)?,
            triangles: cursor
                .list(triangles, 12, |cursor| Ok([cursor.u32()?, cursor.u32()?, cursor.u32()?]))?,
            kinds: cursor.padded(constraints)?,
            text: serde_json::from_slice(&cursor.padded(json_size)?)
                .map_err(|error| DecodeError::Json { detail: error.to_string() })?,
        })
    }
}
