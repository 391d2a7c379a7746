//! The built programs as processes, the repository's structure, and its documents.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a panic is how a test fails"
)]

mod bad_input;
mod browser;
mod console;
mod control_characters;
mod crowd;
mod demo;
mod documents;
mod domain;
mod energy;
mod examples;
mod faults;
mod forces;
mod foxglove;
#[path = "../../viewer-bridge/tests/sockets/foxglove_client.rs"]
#[allow(dead_code, reason = "its other half is used by the tests that have no node")]
mod foxglove_client;
mod info;
mod lifecycle;
mod node;
mod one_build;
mod pace;
mod packaging;
mod physics;
mod readers;
mod recording;
mod schemas;
mod simulate;
mod tidy;
mod viewer;
#[path = "../../viewer-bridge/tests/wire_decoder.rs"]
mod wire_decoder;
