//! Encodes states for the pages, once per format, and measures the cost.

use bytes::Bytes;
use sim_contract::clock::{SECOND_NS, monotonic_ns};

use super::frame_set::{ColliderSet, Formats, FrameProperties, FrameSet};
use crate::sink::State;
use crate::wire::convert::{microseconds, to_f32};
use crate::wire::{
    Colliders, Forces, Format, FrameHead, FrameLimits, Ghost, Inspected, Scene, Speeds, Stamp,
    encode_frame,
};

/// Values of a state besides the positions that pages want.
#[derive(Debug, Default)]
pub(super) struct Wanted {
    pub(super) speeds: bool,
    /// Particles whose exact states a page wants, ascending.
    pub(super) particles: Vec<u32>,
}

/// Encodes states for the pages.
#[derive(Debug, Default)]
pub(super) struct FrameEncoder {
    limits: FrameLimits,
    last_number: u32,
    colliders: Option<ColliderSet>,
    last_collider_number: u64,
    cost: Cost,
}

/// The cost of encoding since a moment.
#[derive(Debug, Default)]
struct Cost {
    begin_ns: u64,
    encode_ns: u64,
    frame_count: u32,
}

/// The cost of encoding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EncodeRate {
    /// Mean time per frame in µs.
    pub(super) encode_us: f32,
    pub(super) frames_per_second: f32,
}

impl FrameEncoder {
    pub(super) fn begin_load(&mut self, scene: &Scene) {
        self.limits = FrameLimits::around(scene.bounds());
        self.colliders = None;
    }

    pub(super) fn set_colliders(&mut self, colliders: &Colliders) {
        self.last_collider_number += 1;
        let (number, bytes) = (self.last_collider_number, colliders.encode());
        self.colliders = Some(ColliderSet { number, bytes });
    }

    pub(super) fn encode(
        &mut self,
        state: &State<'_>,
        formats: Formats,
        wanted: &Wanted,
    ) -> FrameSet {
        let begin_ns = monotonic_ns();
        self.last_number = self.last_number.wrapping_add(1);
        let head = FrameHead {
            stamp: Stamp { epoch: state.epoch, step: state.row.step },
            sim_time_s: state.sim_time_s,
            flags: state.flags,
            torn_count: state.row.torn_count,
            solve_us: microseconds(state.row.solve_ns),
            wake_late_us: microseconds(state.row.wake_late_ns),
            number: self.last_number,
            publish_monotonic_ns: state.publish_monotonic_ns,
        };
        let encode = |format| encode_frame(&head, state.particles, format, &self.limits);
        let frame = FrameSet {
            number: head.number,
            properties: FrameProperties::from_state(state),
            f32: formats.f32.then(|| encode(Format::F32)),
            u16: formats.u16.then(|| encode(Format::U16)),
            colliders: self.colliders.clone(),
            forces: state.forces.map(|forces| encode_forces(head.stamp, forces)),
            ghost: state.ghost.map(Ghost::encode),
            speeds: wanted
                .speeds
                .then(|| Speeds::from_particles(head.stamp, state.particles).encode()),
            inspected: (!wanted.particles.is_empty()).then(|| {
                Inspected::from_particles(head.stamp, state.particles, &wanted.particles).encode()
            }),
        };
        self.cost.encode_ns += monotonic_ns().saturating_sub(begin_ns);
        self.cost.frame_count += 1;
        frame
    }

    /// Returns the cost since the last call, and starts measuring anew.
    pub(super) fn take_rate(&mut self) -> EncodeRate {
        let now_ns = monotonic_ns();
        let Cost { begin_ns, encode_ns, frame_count } =
            std::mem::replace(&mut self.cost, Cost { begin_ns: now_ns, ..Cost::default() });
        let count = f64::from(frame_count);
        let elapsed_s = now_ns.saturating_sub(begin_ns) as f64 / SECOND_NS as f64;
        EncodeRate {
            encode_us: to_f32(encode_ns as f64 / 1000.0 / count.max(1.0)),
            frames_per_second: to_f32(count / elapsed_s.max(1e-9)),
        }
    }
}

fn encode_forces(stamp: Stamp, forces: &sim_contract::Forces) -> Bytes {
    Forces { stamp, rate_hz: forces.header.rate_hz, rows: forces.rows.clone() }.encode()
}
