//! Scenes of the benchmark.

pub(crate) mod graphs;
pub(crate) mod mesh;
pub(crate) mod sheet;
pub(crate) mod touching;
