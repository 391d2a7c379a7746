//! Encodes a message from its beginning to its end.

use bytes::Bytes;

use super::header::{KIND_VERSION, Kind, Stamp};
use crate::wire::convert::count_u32;

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
