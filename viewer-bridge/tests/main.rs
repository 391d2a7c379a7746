//! The server of the viewer on sockets, and the layout of its messages.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a panic is how a test fails"
)]

mod decoder;
mod golden;
mod sockets;
mod wire_decoder;
