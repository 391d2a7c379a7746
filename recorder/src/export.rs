//! Turns the states of a recording into files of other programs.

pub(crate) mod pictures;
pub(crate) mod scene_state;
pub(crate) mod selection;
