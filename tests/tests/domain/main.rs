//! A domain as its user sees it: the list of its nodes, and the state of one over time.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod ps;
mod watch;
