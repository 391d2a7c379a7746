//! The C library, as programs in C use it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a panic is how a test fails"
)]

mod commands;
mod header;
mod misuse;
mod reading;
mod support;
