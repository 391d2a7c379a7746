//! The solver, from scene texts to state hashes.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a panic is how a test fails"
)]

mod builtin;
mod commands;
mod determinism;
mod golden;
mod kernels;
mod meshes;
mod physics;
mod poses;
mod preparation;
mod scene_warnings;
mod step_work;
