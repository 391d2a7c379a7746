//! A test harness that builds the programs once, starts them as processes in a separate domain,
//! polls for conditions with a deadline, and leaves nothing behind.
#![forbid(unsafe_code)]
#![allow(clippy::expect_used, clippy::panic, reason = "a panic is how a test fails")]

pub mod faults;
mod finished;
mod process;
mod programs;
mod sandbox;
mod signals;
pub mod storm;
mod streams;
mod wait;

pub use finished::Finished;
pub use process::{Process, allow_many_open_files, ctl, record};
pub use programs::{Program, build_products, build_products_and_bodies};
pub use rustix::process::Signal;
pub use sandbox::Sandbox;
pub use streams::{Stream, Streams};
pub use wait::{DEADLINE, Deadline, wait_for};

/// Compiles the program on the page for Rust.
#[cfg(doctest)]
#[doc = include_str!("../../docs/rust-and-c.md")]
struct DocsDoctests;
