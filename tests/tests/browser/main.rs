//! The page in a real browser, on the built node and bridge. A user's hands are events of mouse and
//! keys; what they did is read from the node's own snapshots, and what is seen from pixels. No
//! figure of speed is asserted. The pages' errors fail each test.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a panic is how a test fails"
)]

mod hands;
mod pages;
mod picture;
mod replay;
mod support;
mod time;
