//! Values that JSON has no exact form for.

pub mod hash;
pub(crate) mod non_finite;
