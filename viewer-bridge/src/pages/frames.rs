//! The newest state, as pages receive it.

use bytes::Bytes;
use sim_host::clock::{SECOND_NS, monotonic_ns};

use crate::limits::F32_PARTICLES_MAX;
use crate::message::Choice;
use crate::sink::State;
use crate::wire::{
    Colliders, Forces, Format, FrameHead, FrameLimits, Ghost, Inspected, Scene, Speeds, Stamp,
    encode_frame, frame_flag, microseconds, to_f32,
};

/// The newest state, in every format that a page waited for.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameSet {
    /// Number of the frame; ascending.
    pub(crate) number: u32,
    /// The properties that decide the format of each page.
    pub(crate) properties: FrameProperties,
    /// FRAME f32.
    pub(crate) f32: Option<Bytes>,
    /// FRAME u16.
    pub(crate) u16: Option<Bytes>,
    /// The colliders of the load, if it has any.
    pub(crate) colliders: Option<ColliderSet>,
    /// FORCES of the same step, if they were read.
    pub(crate) forces: Option<Bytes>,
    /// GHOST beside it, if a ghost is chosen and has a state there.
    pub(crate) ghost: Option<Bytes>,
    /// SPEEDS of the same step, if a page wants them.
    pub(crate) speeds: Option<Bytes>,
    /// INSPECTED of the same step, with the particles that any page wants.
    pub(crate) inspected: Option<Bytes>,
}

impl FrameSet {
    /// Size of all messages.
    pub(super) fn size_bytes(&self) -> usize {
        let colliders = self.colliders.as_ref().map(|colliders| &colliders.bytes);
        let Self { f32, u16, forces, ghost, speeds, inspected, .. } = self;
        let messages = [f32, u16, forces, ghost, speeds, inspected].map(Option::as_ref);
        messages.into_iter().chain([colliders]).flatten().map(Bytes::len).sum()
    }
}

/// The colliders of a state.
#[derive(Debug, Clone)]
pub(crate) struct ColliderSet {
    /// Changes with every change of the colliders.
    pub(crate) number: u64,
    /// COLLIDERS.
    pub(crate) bytes: Bytes,
}

/// The formats that pages wait for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Formats {
    /// FRAME f32.
    pub f32: bool,
    /// FRAME u16.
    pub u16: bool,
}

impl Formats {
    /// Returns whether a page waits for a frame.
    pub fn is_any(self) -> bool {
        self.f32 || self.u16
    }

    pub(super) fn add(&mut self, format: Format) {
        match format {
            Format::F32 => self.f32 = true,
            Format::U16 => self.u16 = true,
        }
    }
}

/// The properties of a state that decide the format in which a page receives it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FrameProperties {
    /// Number of particles.
    pub(crate) particle_count: usize,
    /// Nothing moves until the next command.
    pub(crate) is_paused: bool,
}

impl FrameProperties {
    pub(super) fn from_state(state: &State<'_>) -> Self {
        let is_paused = state.flags & frame_flag::PAUSED != 0;
        Self { particle_count: state.particles.len(), is_paused }
    }

    /// The format for a page. Exact positions are worth their size while they stay on show.
    pub(super) fn format_for(self, choice: Choice) -> Format {
        let is_exact = self.is_paused || self.particle_count <= F32_PARTICLES_MAX;
        match choice {
            Choice::F32 => Format::F32,
            Choice::Auto if is_exact => Format::F32,
            Choice::Auto | Choice::U16 => Format::U16,
        }
    }
}

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
