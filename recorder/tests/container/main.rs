//! The check and the repair of whole files, on small recordings in memory.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod check;
mod format_4;
mod recording;
mod repair;
