//! Reads a message from its beginning to its end.

use super::decode_error::DecodeError;

/// The unread rest of a message.
#[derive(Debug)]
pub(super) struct Cursor<'a> {
    rest: &'a [u8],
    /// Place of `rest` in the message.
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, at: 0 }
    }

    pub(super) fn bytes(&mut self, size: usize) -> Result<&'a [u8], DecodeError> {
        let (bytes, rest) = self
            .rest
            .split_at_checked(size)
            .ok_or(DecodeError::TooShort { at: self.at, needed: size })?;
        (self.rest, self.at) = (rest, self.at + size);
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N)?);
        Ok(array)
    }

    pub(super) fn u16(&mut self) -> Result<u16, DecodeError> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, DecodeError> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, DecodeError> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Result<f32, DecodeError> {
        self.array().map(f32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64, DecodeError> {
        self.array().map(f64::from_le_bytes)
    }

    pub(super) fn vector(&mut self) -> Result<[f32; 3], DecodeError> {
        Ok([self.f32()?, self.f32()?, self.f32()?])
    }

    /// Reads `count` elements of `size` bytes with `one`. Refuses a count that the message cannot hold
    /// before it allocates memory.
    pub(super) fn list<T>(
        &mut self,
        count: u32,
        size: usize,
        mut one: impl FnMut(&mut Self) -> Result<T, DecodeError>,
    ) -> Result<Vec<T>, DecodeError> {
        let needed = (count as usize).saturating_mul(size);
        if needed > self.rest.len() {
            return Err(DecodeError::TooShort { at: self.at, needed });
        }
        (0..count).map(|_| one(self)).collect()
    }

    /// Reads bytes and the zeros after them up to the next multiple of four.
    pub(super) fn padded(&mut self, count: u32) -> Result<Vec<u8>, DecodeError> {
        let bytes = self.bytes(count as usize)?.to_vec();
        self.pad()?;
        Ok(bytes)
    }

    pub(super) fn pad(&mut self) -> Result<(), DecodeError> {
        self.bytes(self.at.next_multiple_of(4) - self.at).map(|_| ())
    }

    pub(super) fn end(&self) -> Result<(), DecodeError> {
        if self.rest.is_empty() {
            Ok(())
        } else {
            Err(DecodeError::TooLong { extra: self.rest.len() })
        }
    }
}
