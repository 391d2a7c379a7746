//! When a node makes its next step: after a long wait, beside a load, and in lockstep with other processes.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod distant_step;
mod load;
mod lockstep;
