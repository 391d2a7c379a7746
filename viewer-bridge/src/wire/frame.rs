//! FRAME: the positions after a step.

use bytes::Bytes;
use sim_contract::ParticleState;

use super::writer::{Kind, Stamp, Writer};

/// Encoding of positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// The values of the node.
    F32,
    /// 65,536 steps across their bounding box.
    U16,
}

/// The bits of a frame's flags.
pub mod frame_flag {
    /// The node was paused when it made the step, or the replay is paused.
    pub const PAUSED: u32 = 1;
    /// A recording is on show.
    pub const REPLAY: u32 = 1 << 1;
    /// Positions outside the box that u16 covers were moved to its border.
    pub const SATURATED: u32 = 1 << 2;
}

/// Everything in a frame except its positions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrameHead {
    /// Load and step.
    pub stamp: Stamp,
    /// Simulated time in s.
    pub sim_time_s: f64,
    /// [`frame_flag`] bits; the encoder adds SATURATED.
    pub flags: u32,
    /// Number of torn constraints in this state.
    pub torn_count: u32,
    /// Solver time of the step in µs.
    pub solve_us: f32,
    /// Delay of the step's start after its deadline, in µs.
    pub wake_late_us: f32,
    /// Number of the frame, for the acknowledgement.
    pub number: u32,
    /// `CLOCK_MONOTONIC` at publication, in ns.
    pub publish_monotonic_ns: u64,
}

/// The largest box that u16 positions cover. Without it, one particle that flies off would cost all
/// others their resolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameLimits {
    min: [f32; 3],
    max: [f32; 3],
}

/// An axis-aligned box; zeros if it contains nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub min: [f32; 3],
    /// Upper corner.
    pub max: [f32; 3],
}

/// Half edge of the covered box, in half diagonals of the scene's box.
const COVERED_HALF_DIAGONALS: f32 = 16.0;
/// Smallest half edge of the covered box, in m: a scene of one particle has no extent.
const COVERED_HALF_EDGE_MIN: f32 = 10.0;
/// Largest value of a u16 coordinate.
const STEPS: f32 = 65_535.0;
/// Size of the part before the positions.
const HEAD_SIZE_BYTES: usize = 88;

impl Default for FrameLimits {
    fn default() -> Self {
        Self::around(Bounds::default())
    }
}

impl FrameLimits {
    /// Computes the limits for a scene whose positions lie in this box.
    pub fn around(Bounds { min, max }: Bounds) -> Self {
        let squares: f32 = (0..3).map(|axis| (max[axis] - min[axis]).powi(2)).sum();
        let reach = (squares.sqrt() * 0.5 * COVERED_HALF_DIAGONALS).max(COVERED_HALF_EDGE_MIN);
        let middle = |axis: usize| f32::midpoint(min[axis], max[axis]);
        let at = |sign: f32| std::array::from_fn(|axis| middle(axis) + sign * reach);
        Self { min: at(-1.0), max: at(1.0) }
    }
}

impl Bounds {
    /// Computes the bounding box of the finite positions.
    pub fn around(positions: impl Iterator<Item = [f32; 3]>) -> Self {
        let empty = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };
        let bounds = positions.filter(is_finite).fold(empty, |mut bounds, position| {
            for (axis, coordinate) in position.into_iter().enumerate() {
                bounds.min[axis] = bounds.min[axis].min(coordinate);
                bounds.max[axis] = bounds.max[axis].max(coordinate);
            }
            bounds
        });
        if bounds.min[0] > bounds.max[0] { Self::default() } else { bounds }
    }
}

fn is_finite(position: &[f32; 3]) -> bool {
    position.iter().all(|axis| axis.is_finite())
}

/// Encodes a frame.
pub fn encode(
    head: &FrameHead,
    particles: &[ParticleState],
    format: Format,
    limits: &FrameLimits,
) -> Bytes {
    let positions = particles.iter().map(|particle| particle.position);
    let Bounds { min: mut lo, max: mut hi } = Bounds::around(positions);
    let not_finite: Vec<u32> = (0..)
        .zip(particles)
        .filter(|(_, particle)| !is_finite(&particle.position))
        .map(|(index, _)| index)
        .collect();
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
    writer.count(particles);
    writer.u32(flags);
    writer.vector(lo);
    writer.vector(scale);
    writer.count(&not_finite);
    writer.u32(head.torn_count);
    writer.f32(head.solve_us);
    writer.f32(head.wake_late_us);
    writer.u32(head.number);
    writer.u32(0);
    writer.u64(head.publish_monotonic_ns);
    match format {
        Format::F32 => put_f32(writer.reserve(12 * particles.len()), particles, lo),
        Format::U16 => put_u16(writer.reserve(6 * particles.len()), particles, lo, scale),
    }
    writer.pad();
    for particle in not_finite {
        writer.u32(particle);
    }
    writer.finish()
}

fn put_f32(bytes: &mut [u8], particles: &[ParticleState], lo: [f32; 3]) {
    for (place, particle) in bytes.chunks_exact_mut(12).zip(particles) {
        let position = if is_finite(&particle.position) { particle.position } else { lo };
        for (bytes, axis) in place.chunks_exact_mut(4).zip(position) {
            bytes.copy_from_slice(&axis.to_le_bytes());
        }
    }
}

fn put_u16(bytes: &mut [u8], particles: &[ParticleState], lo: [f32; 3], scale: [f32; 3]) {
    // Along an axis without extent, every value is 0.
    let per_unit = scale.map(|scale| if scale > 0.0 { 1.0 / scale } else { 0.0 });
    for (place, particle) in bytes.chunks_exact_mut(6).zip(particles) {
        let position = if is_finite(&particle.position) { particle.position } else { lo };
        for (axis, bytes) in place.chunks_exact_mut(2).enumerate() {
            let value = quantised((position[axis] - lo[axis]) * per_unit[axis]);
            bytes.copy_from_slice(&value.to_le_bytes());
        }
    }
}

/// Rounds to the nearest step.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, and a position outside the box belongs at its border"
)]
fn quantised(steps: f32) -> u16 {
    (steps + 0.5) as u16
}
