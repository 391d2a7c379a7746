//! Turns the states of a recording into files of other programs.

pub(crate) mod data;
pub(crate) mod frame_names;
pub(crate) mod frames;
pub(crate) mod pictures;
pub(crate) mod selection;
pub(crate) mod snapshots;
