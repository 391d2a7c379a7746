//! The browser and what tests do with it.

mod camera;
mod chromium;
mod picture;
mod replay;
mod stage;
mod tab;

pub(crate) use camera::{Camera, distance};
pub(crate) use picture::{Area, Picture, is_cloth, is_held, is_particle, is_pin};
pub(crate) use replay::Replay;
pub(crate) use stage::{Stage, State};
pub(crate) use tab::Button;
