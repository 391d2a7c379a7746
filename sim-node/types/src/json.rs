//! Values that JSON has no exact form for: numbers that may be non-finite, where the strings "nan", "inf" and "-inf" replace a
//! number, and hashes.

use std::fmt;

use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize, Serializer};

/// An f32 that JSON preserves bit for bit, except that any NaN becomes `f32::NAN`.
///
/// A finite value is written with the fewest digits that read back as the same f32, a non-finite
/// value as the string "nan", "inf" or "-inf".
///
/// Two numbers are equal if JSON writes them alike: any NaN equals any other, and 0 differs from -0.
#[derive(Debug, Clone, Copy)]
pub struct PlainF32(pub f32);

impl PartialEq for PlainF32 {
    fn eq(&self, other: &Self) -> bool {
        let (a, b) = (self.0, other.0);
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    }
}

impl Eq for PlainF32 {}

impl Serialize for PlainF32 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let value = self.0;
        if value.is_nan() {
            return serializer.serialize_str("nan");
        }
        if value.is_infinite() {
            return serializer.serialize_str(if value > 0.0 { "inf" } else { "-inf" });
        }
        // Readers parse f64 and then round to f32. If this double rounding would change the value,
        // the exact f64 is written instead of the shortest f32.
        let exact = f64::from(value);
        let is_shortest_safe =
            value.to_string().parse::<f64>().is_ok_and(|parsed| rounds_to(parsed, value));
        if is_shortest_safe {
            serializer.serialize_f32(value)
        } else {
            serializer.serialize_f64(exact)
        }
    }
}

fn rounds_to(parsed: f64, value: f32) -> bool {
    to_f32(parsed).to_bits() == value.to_bits()
}

#[allow(clippy::cast_possible_truncation, reason = "this is the one rounding to f32")]
fn to_f32(value: f64) -> f32 {
    value as f32
}

impl<'de> Deserialize<'de> for PlainF32 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PlainVisitor)
    }
}

struct PlainVisitor;

impl Visitor<'_> for PlainVisitor {
    type Value = PlainF32;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, \"nan\", \"inf\" or \"-inf\"")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<PlainF32, E> {
        Ok(PlainF32(to_f32(value)))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<PlainF32, E> {
        self.visit_f64(value as f64)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<PlainF32, E> {
        self.visit_f64(value as f64)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<PlainF32, E> {
        match text {
            "nan" => Ok(PlainF32(f32::NAN)),
            "inf" => Ok(PlainF32(f32::INFINITY)),
            "-inf" => Ok(PlainF32(f32::NEG_INFINITY)),
            _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
        }
    }
}

/// `#[serde(with = "json_hash")]` for a hash: 16 lowercase hex digits in a string, because many readers of
/// JSON round large numbers.
pub mod hash {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    /// Writes a hash.
    ///
    /// # Errors
    /// Those of the serializer.
    #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
    pub fn serialize<S: Serializer>(value: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{value:016x}"))
    }

    /// Reads a hash.
    ///
    /// # Errors
    /// The text is not a number of hex digits.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        let text = String::deserialize(deserializer)?;
        u64::from_str_radix(&text, 16).map_err(|_| D::Error::custom("expected 16 hex digits"))
    }
}

/// `#[serde(with = "double")]` for an f64 field. A non-finite value is written as a string, like a non-finite f32.
pub(crate) mod double {
    use super::{Deserialize, Deserializer, PlainF32, Serialize, Serializer, to_f32};

    /// A number, or the text of a non-finite one.
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Double {
        Finite(f64),
        Other(PlainF32),
    }

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
    pub(crate) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if value.is_finite() {
            serializer.serialize_f64(*value)
        } else {
            PlainF32(to_f32(*value)).serialize(serializer)
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(match Double::deserialize(deserializer)? {
            Double::Finite(number) => number,
            Double::Other(PlainF32(number)) => number.into(),
        })
    }
}

/// `#[serde(with = "number")]` for an f32 field.
pub(crate) mod number {
    use super::{Deserialize, Deserializer, PlainF32, Serialize, Serializer};

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
    pub(crate) fn serialize<S: Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
        PlainF32(*value).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
        PlainF32::deserialize(deserializer).map(|number| number.0)
    }
}

/// `#[serde(with = "vector")]` for a field of three f32.
pub(crate) mod vector {
    use super::{Deserialize, Deserializer, PlainF32, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        value: &[f32; 3],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(PlainF32).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<[f32; 3], D::Error> {
        <[PlainF32; 3]>::deserialize(deserializer).map(|numbers| numbers.map(|number| number.0))
    }
}

/// `#[serde(with = "optional_number")]` for an f32 field that may be absent.
pub(crate) mod optional_number {
    use super::{Deserialize, Deserializer, PlainF32, Serialize, Serializer};

    #[allow(
        clippy::ref_option,
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature that serde requires"
    )]
    pub(crate) fn serialize<S: Serializer>(
        value: &Option<f32>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(PlainF32).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<f32>, D::Error> {
        let number = Option::<PlainF32>::deserialize(deserializer)?;
        Ok(number.map(|number| number.0))
    }
}

/// `#[serde(with = "rotation")]` for a quaternion.
pub(crate) mod rotation {
    use super::{Deserialize, Deserializer, PlainF32, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        value: &[f32; 4],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.map(PlainF32).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<[f32; 4], D::Error> {
        <[PlainF32; 4]>::deserialize(deserializer).map(|numbers| numbers.map(|number| number.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_equal_if_json_writes_them_alike() {
        let other_nan = f32::from_bits(f32::NAN.to_bits() ^ (1 << 31));
        assert_eq!(PlainF32(f32::NAN), PlainF32(other_nan));
        assert_eq!([PlainF32(1.5); 3], [PlainF32(1.5); 3]);
        assert_ne!(PlainF32(0.0), PlainF32(-0.0));
        assert_ne!(PlainF32(f32::NAN), PlainF32(0.0));
    }
}
