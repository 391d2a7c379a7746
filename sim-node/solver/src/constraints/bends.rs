//! Bends: their projection.

pub(crate) mod block;
pub(crate) mod projection;
