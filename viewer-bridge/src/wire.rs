//! The binary messages, byte for byte as PROTOCOL.md has them.
//!
//! Everything is little-endian, and every array begins at a multiple of four bytes.

mod cursor;
mod decode;
mod frame;
mod scene;
mod small;

use bytes::Bytes;

pub use decode::{DecodeError, Message, decode};
pub use frame::{Format, Frame, FrameHead, FrameLimits, encode as encode_frame, frame_flag};
pub use scene::{Grid, Scene, SceneText, scene_flag};
pub use small::{Colliders, Pins, Statistics, Tear, statistics_flag};

/// Version of every kind of message.
pub const KIND_VERSION: u16 = 1;

/// What a binary message is; the first number of its header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Kind {
    /// A load, with everything that does not change until the next one.
    Scene = 1,
    /// Positions as they are.
    FrameF32 = 2,
    /// Positions in 65,536 steps of their box.
    FrameU16 = 3,
    /// A change of the list of torn constraints.
    Tear = 4,
    /// All particles that are not free.
    Pins = 5,
    /// How node and simulation do.
    Stats = 6,
    /// All colliders.
    Colliders = 7,
}

/// Which state a message is of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp {
    /// The load: each SCENE begins a new one.
    pub epoch: u32,
    /// The step.
    pub step: u64,
}

/// A message that is being written.
#[derive(Debug)]
struct Writer(Vec<u8>);

impl Writer {
    /// Begins with the header of a message of about that size.
    fn new(kind: Kind, stamp: Stamp, size_bytes: usize) -> Self {
        let mut writer = Self(Vec::with_capacity(size_bytes));
        writer.put(&(kind as u16).to_le_bytes());
        writer.put(&KIND_VERSION.to_le_bytes());
        writer.u32(stamp.epoch);
        writer.u64(stamp.step);
        writer
    }

    fn put(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    fn u32(&mut self, value: u32) {
        self.put(&value.to_le_bytes());
    }

    fn u64(&mut self, value: u64) {
        self.put(&value.to_le_bytes());
    }

    fn f32(&mut self, value: f32) {
        self.put(&value.to_le_bytes());
    }

    fn f64(&mut self, value: f64) {
        self.put(&value.to_le_bytes());
    }

    fn vector(&mut self, value: [f32; 3]) {
        for axis in value {
            self.f32(axis);
        }
    }

    /// Zeros up to the next multiple of four.
    fn pad(&mut self) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }

    fn finish(self) -> Bytes {
        Bytes::from(self.0)
    }
}

/// The length of a list, which a limit of the contract keeps within u32.
fn count_of<T>(list: &[T]) -> u32 {
    u32::try_from(list.len()).unwrap_or(u32::MAX)
}
