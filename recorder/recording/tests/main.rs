//! Recordings, read and written by the library.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a panic is how a test fails"
)]

mod complete_state;
mod container;
mod faults;
mod foreign;
mod format;
mod index;
mod tape;
