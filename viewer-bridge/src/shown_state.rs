//! What is on show: one load at a time, and what changes about it. A live node and a recording
//! both put their states on it; it encodes them, and keeps the epochs of the protocol.

use bytes::Bytes;
use sim_contract::clock::{SECOND_NS, monotonic_ns};
use sim_contract::{ColliderState, ParticleState};

use crate::pages::hub::Hub;
use crate::pages::hub::{ColliderSet, FrameSet, Slot};
use crate::wire::{
    Colliders, Format, FrameHead, FrameLimits, Pins, Scene, Stamp, Tear, encode_frame,
};

/// What is on show.
#[derive(Debug, Default)]
pub struct Stage {
    epoch: u32,
    frame_number: u32,
    limits: FrameLimits,
    torn: Vec<u32>,
    pins: Vec<[u32; 2]>,
    colliders: Vec<ColliderState>,
    /// The same as bytes; none until the load has some.
    collider_set: Option<ColliderSet>,
    collider_number: u64,
    cost: Cost,
}

/// What encoding takes.
#[derive(Debug, Default)]
struct Cost {
    begin_ns: u64,
    encode_ns: u64,
    frame_count: u32,
}

/// The mean time to encode a frame, and how many there were per second.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EncodeRate {
    /// In µs.
    pub encode_us: f32,
    /// Per second.
    pub frames_per_second: f32,
}

impl Stage {
    /// Number of the load; 0 before the first one.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// The constraints that are torn, in the order of tearing.
    pub fn torn(&self) -> &[u32] {
        &self.torn
    }

    /// Shows another load, of which nothing is torn, held or moved yet.
    pub fn begin(&mut self, hub: &Hub, mut scene: Scene) {
        self.epoch = self.epoch.wrapping_add(1);
        scene.stamp.epoch = self.epoch;
        let (min, max) = scene.bounds();
        self.limits = FrameLimits::around(min, max);
        self.torn.clear();
        self.pins.clear();
        self.colliders.clear();
        self.collider_set = None;
        hub.latch_binary(Slot::Scene, scene.encode(), None);
        if let Some(publisher) = hub.publisher() {
            publisher.begin(&scene);
        }
    }

    /// Takes the list of all that is torn after a step. `causes` may be shorter: not known then.
    pub fn set_torn(&mut self, hub: &Hub, step: u64, torn: &[u32], causes: &[u8]) {
        if torn == self.torn {
            return;
        }
        let is_longer = torn.starts_with(&self.torn);
        let first = if is_longer { self.torn.len() } else { 0 };
        let causes: Vec<u8> =
            (0..torn.len()).map(|place| causes.get(place).copied().unwrap_or(u8::MAX)).collect();
        let tear = |first: usize| {
            let (constraints, causes) = (torn[first..].to_vec(), causes[first..].to_vec());
            let first = u32::try_from(first).unwrap_or(u32::MAX);
            Tear { stamp: self.stamp(step), first, constraints, causes }.encode()
        };
        hub.latch_binary(Slot::Tear, tear(0), Some(tear(first)));
        if let Some(publisher) = hub.publisher() {
            publisher.set_torn(step, torn, causes.as_slice(), first);
        }
        self.torn = torn.to_vec();
    }

    /// Takes the colliders after a step. They are sent with the next frame.
    pub fn set_colliders(&mut self, step: u64, colliders: &[ColliderState]) {
        if colliders == self.colliders {
            return;
        }
        self.colliders = colliders.to_vec();
        self.collider_number += 1;
        let bytes = Colliders { stamp: self.stamp(step), colliders: colliders.to_vec() }.encode();
        self.collider_set = Some(ColliderSet { number: self.collider_number, bytes });
    }

    /// Takes what is held after a step.
    pub fn set_pins(&mut self, hub: &Hub, step: u64, particles: &[ParticleState]) {
        let held = Pins::of(particles);
        if held != self.pins {
            let pins = Pins { stamp: self.stamp(step), held: held.clone() };
            hub.latch_binary(Slot::Pins, pins.encode(), None);
            self.pins = held;
        }
    }

    /// Shows a state to those who wait for one. Load and number of the head are filled in.
    pub fn show(&mut self, hub: &Hub, mut head: FrameHead, particles: &[ParticleState]) {
        let demand = hub.demand(particles.len());
        if let Some(publisher) = hub.publisher()
            && demand.foxglove
        {
            publisher.show(head.stamp.step, particles);
        }
        if !demand.is_of_pages() {
            return;
        }
        let begin_ns = monotonic_ns();
        self.frame_number = self.frame_number.wrapping_add(1);
        head.stamp.epoch = self.epoch;
        head.number = self.frame_number;
        let encode = |format| -> Bytes { encode_frame(&head, particles, format, &self.limits) };
        hub.show(FrameSet {
            number: head.number,
            particle_count: particles.len(),
            f32: demand.f32.then(|| encode(Format::F32)),
            u16: demand.u16.then(|| encode(Format::U16)),
            colliders: self.collider_set.clone(),
        });
        self.cost.encode_ns += monotonic_ns() - begin_ns;
        self.cost.frame_count += 1;
    }

    /// What encoding took since the last call.
    pub fn take_encode_rate(&mut self) -> EncodeRate {
        let now_ns = monotonic_ns();
        let Cost { begin_ns, encode_ns, frame_count } =
            std::mem::replace(&mut self.cost, Cost { begin_ns: now_ns, ..Cost::default() });
        let count = f64::from(frame_count);
        let passed_s = now_ns.saturating_sub(begin_ns) as f64 / SECOND_NS as f64;
        EncodeRate {
            encode_us: single(encode_ns as f64 / 1000.0 / count.max(1.0)),
            frames_per_second: single(count / passed_s.max(1e-9)),
        }
    }

    fn stamp(&self, step: u64) -> Stamp {
        Stamp { epoch: self.epoch, step }
    }
}

/// For statistics, where f32 is plenty.
#[allow(clippy::cast_possible_truncation, reason = "a number to look at")]
pub(crate) fn single(number: f64) -> f32 {
    number as f32
}
