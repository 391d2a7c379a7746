//! Particles and constraints, stepped at a fixed rate with the same bits on every machine.
//!
//! A [`Scene`] is checked text. A [`Solver`] made from it holds the running state. Commands change it
//! at the boundary before a step, [`Solver::step`] makes a step, and [`Solver::state_hash`] identifies
//! the result. The particles of a step and its [`Keyframe`] form the complete state.
//!
//! ```
//! use sim_solver::{Grab, Scene, Solver, builtin};
//!
//! let scene = Scene::from_toml(builtin::text("curtain").unwrap(), "curtain")?;
//! let mut solver = Solver::new(&scene);
//! solver.grab(7, Grab { particle: 90, target: [0.5, 0.2, 0.3], over_s: 0.1 })?;
//! for _ in 0..240 {
//!     solver.step();
//! }
//! assert_eq!(solver.particle(90).position, [0.5, 0.2, 0.3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This crate has no processes, clocks, files or messages.
#![deny(unsafe_code)]
#![allow(
    clippy::inline_always,
    reason = "a kernel that is not inlined is compiled for the baseline processor, and passes vectors in memory"
)]

mod checks;
mod commands;
mod constraints;
mod contacts;
mod frame;
mod kernels;
mod motion;
mod parameters;
mod solver;
mod state;
mod step;
mod store;
mod warnings;

pub use commands::apply::{Applied, Control};
pub use commands::cut::{Sphere, Sweep};
pub use commands::preparation::{Plan, Prepared, Spare};
pub use commands::{Grab, Push};
pub use contacts::bodies::driven_body::BodyMotion;
pub use contacts::colliders::PlacedCollider;
pub use kernels::Kernels;
pub use kernels::worker_pool::THREADS_MAX;
pub use motion::MOTION_POINTS_MAX;
pub use sim_scene::constraints::Constraint;
pub use sim_scene::constraints::bends::{Bend, BendShape, RestShape};
pub use sim_scene::constraints::sides::TornSides;
pub use sim_scene::rotation::Pose;
pub use sim_scene::scene::{ColliderGeometry, Scene, SceneError, SolverSettings};
pub use sim_scene::{builtin, scene};
pub use sim_types::{
    Action, BlockValue, COORDINATE_MAX, ConstraintKind, Method, OVER_S_MAX, PARAMETERS, Parameter,
    ParameterValue, ParameterValues, Part, ParticleFlags, Reason, Setting, TearCause,
};
pub use solver::Solver;
pub use state::blocks::{Blocks, Chain};
pub use state::energy::{Energy, EnergyMeter};
pub use state::forces::{ColliderImpulse, Forces, FrameImpulse, ParticleImpulse};
pub use state::keyframe::{Keyframe, KeyframeError};
pub use state::particles::Particle;
pub use state::restore::RestoreError;
pub use warnings::warnings;

/// Version of the arithmetic. It changes whenever a step produces other bits. Only the version that
/// made a recording can re-simulate it.
pub const SOLVER_VERSION: u32 = 11;
