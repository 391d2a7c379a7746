//! FRAME: the positions of a step.

use bytes::Bytes;
use sim_contract::ParticleState;

use super::cursor::Cursor;
use super::{DecodeError, Kind, Stamp, Writer, count_of};

/// How positions are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// As the node has them.
    F32,
    /// In 65,536 steps of their box.
    U16,
}

/// The bits of a frame's flags.
pub mod frame_flag {
    /// The step was made while the node was paused.
    pub const PAUSED: u32 = 1;
    /// A recording is shown.
    pub const REPLAY: u32 = 1 << 1;
    /// Positions were outside of what u16 covers, and stand at its border.
    pub const SATURATED: u32 = 1 << 2;
}

/// What a frame says beside its positions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrameHead {
    /// Load and step.
    pub stamp: Stamp,
    /// Simulated time in s.
    pub sim_time_s: f64,
    /// [`frame_flag`] bits; the encoder adds SATURATED.
    pub flags: u32,
    /// Constraints torn in this state.
    pub torn_count: u32,
    /// Time of the solver for the step, in µs.
    pub solve_us: f32,
    /// How late the step began, in µs.
    pub wake_late_us: f32,
    /// Number of the frame, for its acknowledgement.
    pub number: u32,
    /// CLOCK_MONOTONIC at publication, in ns.
    pub publish_monotonic_ns: u64,
}

/// The most that u16 positions cover: beyond it, one particle that flies off would take all
/// resolution from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameLimits {
    min: [f32; 3],
    max: [f32; 3],
}

/// Half of the covered box, in half diagonals of the scene's.
const COVERED_HALF_DIAGONALS: f32 = 16.0;
/// Least half edge of the covered box, in m: a scene of one particle has no size.
const COVERED_HALF_EDGE_MIN: f32 = 10.0;
/// Highest value of a u16 coordinate.
const STEPS: f32 = 65_535.0;
/// Size of a frame before its positions.
const HEAD_SIZE_BYTES: usize = 88;

impl Default for FrameLimits {
    fn default() -> Self {
        Self::around([0.0; 3], [0.0; 3])
    }
}

impl FrameLimits {
    /// The limits of a scene whose positions lie in that box.
    pub fn around(min: [f32; 3], max: [f32; 3]) -> Self {
        let squares: f32 = (0..3).map(|axis| (max[axis] - min[axis]).powi(2)).sum();
        let reach = (squares.sqrt() * 0.5 * COVERED_HALF_DIAGONALS).max(COVERED_HALF_EDGE_MIN);
        let middle = |axis: usize| f32::midpoint(min[axis], max[axis]);
        let at = |sign: f32| std::array::from_fn(|axis| middle(axis) + sign * reach);
        Self { min: at(-1.0), max: at(1.0) }
    }
}

/// The box around all finite positions (zeros where there are none), and the particles that are not.
pub(super) fn bounds(particles: &[ParticleState]) -> ([f32; 3], [f32; 3], Vec<u32>) {
    let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let mut not_finite = Vec::new();
    for (index, particle) in (0_u32..).zip(particles) {
        let position = particle.position;
        if position.iter().all(|axis| axis.is_finite()) {
            for axis in 0..3 {
                min[axis] = min[axis].min(position[axis]);
                max[axis] = max[axis].max(position[axis]);
            }
        } else {
            not_finite.push(index);
        }
    }
    if min[0] > max[0] {
        return ([0.0; 3], [0.0; 3], not_finite);
    }
    (min, max, not_finite)
}

/// Writes a frame.
pub fn encode(
    head: &FrameHead,
    particles: &[ParticleState],
    format: Format,
    limits: &FrameLimits,
) -> Bytes {
    let (mut lo, mut hi, not_finite) = bounds(particles);
    let mut flags = head.flags;
    if format == Format::U16 {
        for axis in 0..3 {
            let (low, high) = (limits.min[axis], limits.max[axis]);
            if lo[axis] < low || hi[axis] > high {
                flags |= frame_flag::SATURATED;
            }
            lo[axis] = lo[axis].clamp(low, high);
            hi[axis] = hi[axis].clamp(low, high);
        }
    }
    let (kind, coordinate_size, steps) = match format {
        Format::F32 => (Kind::FrameF32, 4, 1.0),
        Format::U16 => (Kind::FrameU16, 2, STEPS),
    };
    let scale: [f32; 3] = std::array::from_fn(|axis| (hi[axis] - lo[axis]) / steps);
    let size = HEAD_SIZE_BYTES + 3 * coordinate_size * particles.len() + 4 * not_finite.len() + 4;
    let mut writer = Writer::new(kind, head.stamp, size);
    writer.f64(head.sim_time_s);
    writer.u32(count_of(particles));
    writer.u32(flags);
    writer.vector(lo);
    writer.vector(scale);
    writer.u32(count_of(&not_finite));
    writer.u32(head.torn_count);
    writer.f32(head.solve_us);
    writer.f32(head.wake_late_us);
    writer.u32(head.number);
    writer.u32(0);
    writer.u64(head.publish_monotonic_ns);
    match format {
        Format::F32 => put_f32(&mut writer.0, particles, lo),
        Format::U16 => put_u16(&mut writer.0, particles, lo, scale),
    }
    writer.pad();
    for particle in not_finite {
        writer.u32(particle);
    }
    writer.finish()
}

fn put_f32(bytes: &mut Vec<u8>, particles: &[ParticleState], lo: [f32; 3]) {
    let begin = bytes.len();
    bytes.resize(begin + 12 * particles.len(), 0);
    for (place, particle) in bytes[begin..].chunks_exact_mut(12).zip(particles) {
        let is_finite = particle.position.iter().all(|axis| axis.is_finite());
        let position = if is_finite { particle.position } else { lo };
        for (bytes, axis) in place.chunks_exact_mut(4).zip(position) {
            bytes.copy_from_slice(&axis.to_le_bytes());
        }
    }
}

fn put_u16(bytes: &mut Vec<u8>, particles: &[ParticleState], lo: [f32; 3], scale: [f32; 3]) {
    let begin = bytes.len();
    bytes.resize(begin + 6 * particles.len(), 0);
    // An axis along which nothing extends has the value 0 everywhere.
    let per_unit = scale.map(|scale| if scale > 0.0 { 1.0 / scale } else { 0.0 });
    for (place, particle) in bytes[begin..].chunks_exact_mut(6).zip(particles) {
        let is_finite = particle.position.iter().all(|axis| axis.is_finite());
        let position = if is_finite { particle.position } else { lo };
        for (axis, bytes) in place.chunks_exact_mut(2).enumerate() {
            let value = quantised((position[axis] - lo[axis]) * per_unit[axis]);
            bytes.copy_from_slice(&value.to_le_bytes());
        }
    }
}

/// The nearest step.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, and what is outside of the box belongs at its border"
)]
fn quantised(steps: f32) -> u16 {
    (steps + 0.5) as u16
}

/// A frame as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// How its positions were written.
    pub format: Format,
    /// Everything beside the positions.
    pub head: FrameHead,
    /// Least corner of the box.
    pub lo: [f32; 3],
    /// Units of a step, by axis.
    pub scale: [f32; 3],
    /// The positions, u16 as the numbers that they stand for.
    pub positions: Vec<[f32; 3]>,
    /// The particles whose position is not finite.
    pub not_finite: Vec<u32>,
}

pub(super) fn decode(
    format: Format,
    stamp: Stamp,
    cursor: &mut Cursor<'_>,
) -> Result<Frame, DecodeError> {
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
    let positions = match format {
        Format::F32 => cursor.list(count, 12, Cursor::vector)?,
        Format::U16 => cursor.list(count, 6, |cursor| {
            let steps = [cursor.u16()?, cursor.u16()?, cursor.u16()?];
            Ok(std::array::from_fn(|axis| lo[axis] + scale[axis] * f32::from(steps[axis])))
        })?,
    };
    cursor.pad()?;
    let not_finite = cursor.list(not_finite_count, 4, Cursor::u32)?;
    Ok(Frame { format, head, lo, scale, positions, not_finite })
}
