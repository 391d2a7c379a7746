//! Conversions of numbers for messages and statistics.

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
