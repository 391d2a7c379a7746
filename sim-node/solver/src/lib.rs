//! Particles and constraints, stepped at a fixed rate with the same bits on every machine.
//!
//! A [`Scene`] is checked text; a [`Solver`] made from it is the running state. Commands change it
//! at the boundary before a step, [`Solver::step`] makes one step, and [`Solver::state_hash`] names
//! the result. The particles and the [`Keyframe`] of one step are together the complete state.
//!
//! ```
//! use sim_solver::{Grip, Scene, Solver, builtin};
//!
//! let scene = Scene::from_toml(builtin::text("curtain").unwrap(), "curtain")?;
//! let mut solver = Solver::new(&scene);
//! solver.grab(7, Grip { particle: 90, target: [0.5, 0.2, 0.3], over_s: 0.1 })?;
//! for _ in 0..240 {
//!     solver.step();
//! }
//! assert_eq!(solver.particle(90).position, [0.5, 0.2, 0.3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! There is no process, clock, file or message in this crate.
#![deny(unsafe_code)]
#![allow(
    clippy::inline_always,
    reason = "a kernel that is not inlined is compiled for the oldest processor, and goes through memory"
)]

mod anchors;
mod apply;
mod bodies;
pub mod builtin;
mod colliders;
mod commands;
mod constraints;
mod contact;
mod crew;
mod cut;
mod drive;
mod families;
mod frame;
mod hash;
mod kernels;
mod keyframe;
mod order;
mod pages;
mod parameters;
mod particles;
mod project;
pub mod scene;
mod solid;
mod solver;
mod step;
mod tear;
mod tethers;
mod wind;

pub use apply::{Applied, Control};
pub use colliders::PlacedCollider;
pub use commands::{GRAB_OVER_S_MAX, Grip, Push};
pub(crate) use commands::{check_finite, is_near};
pub use constraints::Constraint;
pub use crew::THREADS_MAX;
pub use cut::{Ball, Sweep};
pub use frame::Pose;
pub use kernels::Kernels;
pub use keyframe::{Keyframe, KeyframeError, RestoreError};
pub use particles::Particle;
pub use scene::{ColliderGeometry, Scene, SceneError, SolverSettings};
pub use sim_types::{
    Action, COORDINATE_MAX, ConstraintKind, Method, PARAMETERS, Parameter, ParameterValue,
    ParameterValues, ParticleFlags, Reason, TearCause,
};
pub use solver::Solver;

/// Version of the arithmetic. It changes with any change of the bits that a step produces, and a
/// recording is re-simulated only by the version that made it.
pub const SOLVER_VERSION: u32 = 3;
