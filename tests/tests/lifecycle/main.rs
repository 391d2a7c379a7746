//! Beginnings and ends of processes: killed clients, requests to stop, and output streams that refuse.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod grabs;
mod stop;
mod streams;
