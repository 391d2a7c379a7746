//! Shared parts of the fuzz targets.
#![forbid(unsafe_code)]

pub mod mcap_file;
pub mod recording;
pub mod simulation;

/// Compares values by their text, in which NaN equals NaN.
pub fn assert_same<T: std::fmt::Debug>(found: &T, expected: &T) {
    assert_eq!(format!("{found:?}"), format!("{expected:?}"));
}
