//! Draws states as pictures.

pub(crate) mod apng;
pub(crate) mod camera;
pub(crate) mod extent;
mod font;
pub(crate) mod mesh;
pub(crate) mod png;
pub(crate) mod renderer;
pub(crate) mod shape;
mod solids;
pub(crate) mod svg;
pub(crate) mod target;
