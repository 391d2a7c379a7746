//! The server over real sockets: who is let in, what pages are told, and what becomes of those that
//! are slow, silent, or talk too much. There is no node: the tests feed the hub themselves.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a panic is how a test fails")]

mod delivery;
mod foxglove;
mod foxglove_client;
mod intruders;
mod misuse;
mod support;
