//! A short text of fixed size, for shared memory.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A text of at most [`Text::SIZE_BYTES_MAX`] bytes of UTF-8, zeros behind it. It is `Copy` and
/// owns no memory, so that it can stand in a command.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text([u8; Text::SIZE_BYTES_MAX]);

impl Text {
    /// Longest text, in bytes.
    pub const SIZE_BYTES_MAX: usize = 160;

    /// The text, cut at its first zero byte and to whole characters within
    /// [`Text::SIZE_BYTES_MAX`]. Compare the length first where a cut text would mean another thing.
    pub fn new(text: &str) -> Self {
        let text = text.split('\0').next().unwrap_or_default();
        let size = text.floor_char_boundary(Self::SIZE_BYTES_MAX);
        let mut bytes = [0; Self::SIZE_BYTES_MAX];
        bytes[..size].copy_from_slice(&text.as_bytes()[..size]);
        Self(bytes)
    }

    /// Reads what another process wrote: as far as it is UTF-8, and nothing behind that.
    pub(crate) fn from_wire(bytes: &[u8; Self::SIZE_BYTES_MAX]) -> Self {
        Self::new(bytes.utf8_chunks().next().map_or("", |chunk| chunk.valid()))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        let valid = self.0.utf8_chunks().next().map_or("", |chunk| chunk.valid());
        valid.trim_end_matches('\0')
    }

    /// As it stands on the wire.
    pub(crate) fn bytes(self) -> [u8; Self::SIZE_BYTES_MAX] {
        self.0
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), formatter)
    }
}

impl fmt::Display for Text {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

impl Serialize for Text {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|text| Self::new(&text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_at_a_whole_character() {
        let long = format!("{}ü and more", "x".repeat(159));
        assert_eq!(Text::new(&long).as_str(), "x".repeat(159));
        let fitting = "ü".repeat(80);
        assert_eq!(Text::new(&fitting).as_str(), fitting);
        assert_eq!(Text::new("").as_str(), "");
    }

    #[test]
    fn what_is_no_text_ends_it() {
        let mut bytes = Text::new("gravity and rubbish").bytes();
        bytes[7] = 0;
        assert_eq!(Text::from_wire(&bytes), Text::new("gravity"));
        bytes[4] = 0xff;
        assert_eq!(Text::from_wire(&bytes), Text::new("grav"));
        assert_eq!(Text::new("grav\0ity").as_str(), "grav");
        assert_eq!(Text::from_wire(&[0xff; 160]).as_str(), "");
    }
}
