//! `#[serde(with = "json_hash")]` for a hash: 16 lowercase hex digits in a string, because many readers of
//! JSON round large numbers.

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
