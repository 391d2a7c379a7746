//! Scenes of particles and constraints: what is simulated, as checked values and as TOML text.
//!
//! A [`Scene`] is the complete scene with every default filled in. Its [`model`](Scene::model) is its expansion: every
//! particle, constraint and triangle, including the generated ones.
//!
//! ```
//! use sim_scene::{Scene, builtin};
//!
//! let scene = Scene::from_toml(builtin::text("curtain").unwrap(), "curtain")?;
//! assert_eq!(scene.counts().particles, 168);
//! assert_eq!(Scene::from_toml(&scene.to_toml(), "printed")?, scene);
//! # Ok::<(), sim_scene::SceneError>(())
//! ```
//!
//! [`scene`] and [`builtin`] are for every program, which finds them in `sim_solver` as well. The other modules are what
//! the solver builds on.
//!
//! From the bottom: `document` parses a text into values with their places, `fields` walks the keys of a table to read or to
//! print it, `definition` and `generate` have the tables, each with its keys, and `read` checks what concerns several tables.
#![forbid(unsafe_code)]

pub mod builtin;
pub mod checks;
pub mod collider_mesh;
pub mod constraints;
mod definition;
mod document;
mod error;
mod fields;
mod generate;
mod lists;
pub mod memory;
mod mesh;
pub mod model;
mod poses;
mod read;
pub mod rotation;
pub mod scene;
mod solids;
mod source;

pub use scene::{Scene, SceneError};
