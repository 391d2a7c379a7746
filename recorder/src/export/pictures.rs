//! Pictures as files.

pub(crate) mod apng;
pub(crate) mod target;
