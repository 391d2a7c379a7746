//! Scenes: those that are built in, what a viewer reads from their text, and a load of one.

pub mod catalog;
pub(crate) mod load;
pub(crate) mod measure;
pub mod summary;
