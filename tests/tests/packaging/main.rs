//! The crates can be packaged, and completion scripts, man pages and units of systemd agree with the
//! programs.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod crates;
mod documents;
mod units;
