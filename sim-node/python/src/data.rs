//! The values that a program exchanges with nodes, simulations and recordings.

pub(crate) mod action;
pub(crate) mod forces;
pub(crate) mod outcome;
pub(crate) mod scene;
#[allow(unsafe_code, reason = "arrays that view memory of Rust")]
pub(crate) mod snapshot;
pub(crate) mod state;
