//! Scenes: reading, printing, and errors.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

mod errors;
mod pieces;
mod scenes;
