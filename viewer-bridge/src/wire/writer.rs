//! The header of every message, and the encoding of the fields after it.

use bytes::Bytes;

/// Version of every kind of message.
pub const KIND_VERSION: u16 = 1;

/// Kind of a binary message: the first number of its header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Kind {
    /// A load, with everything that does not change until the next one.
    Scene = 1,
    /// Positions as f32.
    FrameF32 = 2,
    /// Positions as u16: 65,536 steps across their bounding box.
    FrameU16 = 3,
    /// A change of the list of torn constraints.
    Tear = 4,
    /// All particles that are not free.
    Pins = 5,
    /// Statistics of the node and the scene.
    Stats = 6,
    /// All colliders.
    Colliders = 7,
    /// The impulses of a step.
    Forces = 8,
    /// The speeds of all particles.
    Speeds = 9,
    /// The exact states of some particles.
    Inspected = 10,
    /// The head of an earlier state.
    Past = 11,
    /// A state of another recording.
    Ghost = 12,
    /// A piece of a long message.
    Part = 13,
}

/// Load and step that a message belongs to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp {
    /// Number of the load. Each SCENE begins a new one.
    pub epoch: u32,
    /// Step.
    pub step: u64,
}

/// A message in progress.
#[derive(Debug)]
pub(super) struct Writer(Vec<u8>);

impl Writer {
    /// Writes the header of a message of about this size.
    pub(super) fn new(kind: Kind, stamp: Stamp, size_bytes: usize) -> Self {
        let mut writer = Self(Vec::with_capacity(size_bytes));
        writer.bytes(&(kind as u16).to_le_bytes());
        writer.bytes(&KIND_VERSION.to_le_bytes());
        writer.u32(stamp.epoch);
        writer.u64(stamp.step);
        writer
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.bytes(&value.to_le_bytes());
    }

    pub(super) fn u64(&mut self, value: u64) {
        self.bytes(&value.to_le_bytes());
    }

    pub(super) fn f32(&mut self, value: f32) {
        self.bytes(&value.to_le_bytes());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.bytes(&value.to_le_bytes());
    }

    pub(super) fn vector(&mut self, value: [f32; 3]) {
        for axis in value {
            self.f32(axis);
        }
    }

    /// Writes the length of a list.
    pub(super) fn count<T>(&mut self, list: &[T]) {
        self.u32(count_u32(list.len()));
    }

    /// Appends zeros and returns them, to be overwritten in place.
    pub(super) fn reserve(&mut self, size_bytes: usize) -> &mut [u8] {
        let begin = self.0.len();
        self.0.resize(begin + size_bytes, 0);
        &mut self.0[begin..]
    }

    /// Writes zeros up to the next multiple of four.
    pub(super) fn pad(&mut self) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }

    pub(super) fn finish(self) -> Bytes {
        Bytes::from(self.0)
    }
}

/// Rounds to `f32`, which is precise enough for statistics and positions on a screen.
#[allow(clippy::cast_possible_truncation, reason = "the rounding is the purpose")]
pub(crate) fn to_f32(number: f64) -> f32 {
    number as f32
}

/// Converts nanoseconds to microseconds.
pub(crate) fn microseconds(ns: u64) -> f32 {
    to_f32(ns as f64 / 1000.0)
}

/// Converts a count to `u32`. A limit keeps every count below `u32::MAX`.
pub(crate) fn count_u32(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
