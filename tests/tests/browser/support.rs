//! The browser, and the programs that each test runs.

mod camera;
mod chromium;
mod picture;
mod replay;
mod rig;
mod tab;

pub(crate) use camera::{Camera, distance};
pub(crate) use picture::{
    Area, Picture, is_cloth, is_force, is_ghost, is_grab_mark, is_particle, is_pin,
};
pub(crate) use replay::ReplayRig;
pub(crate) use rig::{Rig, State};
pub(crate) use tab::{Button, Tab};
