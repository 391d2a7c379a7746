//! Distance constraints and bends: their order, and their projection.

pub(crate) mod bends;
pub(crate) mod builder;
pub(crate) mod column_writer;
pub(crate) mod columns;
pub(crate) mod fields;
pub(crate) mod order;
pub(crate) mod parameters;
pub(crate) mod projection;
pub(crate) mod projection_block;
pub(crate) mod separation;
pub(crate) mod tether_pull;
pub(crate) mod tethers;
