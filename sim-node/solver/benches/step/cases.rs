//! The cases of the benchmark, by kind.

pub(crate) mod bends;
pub(crate) mod budget;
pub(crate) mod contacts;
pub(crate) mod cost;
pub(crate) mod forces;
pub(crate) mod meshes;
pub(crate) mod speed;
pub(crate) mod stability;
pub(crate) mod threads;
