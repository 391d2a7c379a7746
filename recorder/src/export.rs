//! Draws the states of a recording as pictures.

pub(crate) mod camera;
pub(crate) mod extent;
mod font;
pub(crate) mod mesh;
pub(crate) mod png;
pub(crate) mod renderer;
pub(crate) mod scene_state;
pub(crate) mod selection;
pub(crate) mod shape;
mod solids;
pub(crate) mod svg;
pub(crate) mod target;
