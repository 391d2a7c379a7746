//! Short text of a fixed size, for commands in shared memory.

pub(crate) mod printable;

use std::error::Error;
use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// UTF-8 text of at most [`Text::SIZE_BYTES_MAX`] bytes, padded with zero bytes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Text([u8; Text::SIZE_BYTES_MAX]);

/// Reason why a string is not a [`Text`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextError {
    /// The string is longer than [`Text::SIZE_BYTES_MAX`].
    TooLong {
        /// Length in bytes.
        size_bytes: usize,
    },
    /// The string contains a zero byte.
    HasZero,
}

impl fmt::Display for TextError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong { size_bytes } => write!(
                formatter,
                "the text has {size_bytes} bytes (allowed: at most {})",
                Text::SIZE_BYTES_MAX
            ),
            Self::HasZero => formatter.write_str("the text contains a zero byte"),
        }
    }
}

impl Error for TextError {}

impl Text {
    /// Size of the longest text, in bytes.
    pub const SIZE_BYTES_MAX: usize = 160;

    /// Copies a string.
    ///
    /// # Errors
    /// The string is too long, or contains a zero byte.
    pub fn new(text: &str) -> Result<Self, TextError> {
        if text.len() > Self::SIZE_BYTES_MAX {
            return Err(TextError::TooLong { size_bytes: text.len() });
        }
        if text.contains('\0') { Err(TextError::HasZero) } else { Ok(Self::cut(text)) }
    }

    /// Copies as many whole characters of a string as fit, up to its first zero byte. Use it only for
    /// text whose end may be lost, such as a name for display.
    pub fn cut(text: &str) -> Self {
        let text = text.split('\0').next().unwrap_or_default();
        let size = text.floor_char_boundary(Self::SIZE_BYTES_MAX);
        let mut bytes = [0; Self::SIZE_BYTES_MAX];
        bytes[..size].copy_from_slice(&text.as_bytes()[..size]);
        Self(bytes)
    }

    /// Reads bytes that another process wrote, up to the first byte that is zero or not UTF-8.
    pub fn from_wire(bytes: &[u8; Self::SIZE_BYTES_MAX]) -> Self {
        Self::cut(bytes.utf8_chunks().next().map_or("", |chunk| chunk.valid()))
    }

    /// Returns the text.
    pub fn as_str(&self) -> &str {
        let valid = self.0.utf8_chunks().next().map_or("", |chunk| chunk.valid());
        valid.trim_end_matches('\0')
    }

    /// Returns the bytes for shared memory: the text, padded with zeros.
    pub fn to_wire(self) -> [u8; Self::SIZE_BYTES_MAX] {
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
        Self::new(&String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_fits_is_kept_and_longer_text_is_refused() {
        let longest = "ü".repeat(80);
        assert_eq!(Text::new(&longest).unwrap().as_str(), longest);
        assert_eq!(Text::new("").unwrap().as_str(), "");
        let error = Text::new(&"x".repeat(161)).unwrap_err();
        assert_eq!(error.to_string(), "the text has 161 bytes (allowed: at most 160)");
        assert_eq!(Text::new("grav\0ity"), Err(TextError::HasZero));
        let json = format!("\"{}\"", "x".repeat(161));
        let error = serde_json::from_str::<Text>(&json).unwrap_err().to_string();
        assert!(error.starts_with("the text has 161 bytes"), "{error}");
    }

    #[test]
    fn cut_text_ends_with_a_whole_character() {
        let long = format!("{}ü and more", "x".repeat(159));
        assert_eq!(Text::cut(&long).as_str(), "x".repeat(159));
        assert_eq!(Text::cut("grav\0ity").as_str(), "grav");
    }

    #[test]
    fn text_from_the_wire_ends_at_the_first_byte_that_is_zero_or_not_utf8() {
        let mut bytes = Text::cut("gravity and rubbish").to_wire();
        bytes[7] = 0;
        assert_eq!(Text::from_wire(&bytes), Text::cut("gravity"));
        bytes[4] = 0xff;
        assert_eq!(Text::from_wire(&bytes), Text::cut("grav"));
        assert_eq!(Text::from_wire(&[0xff; 160]).as_str(), "");
    }
}
