//! A domain as its user sees it: the list of its nodes, the state of one over time, and the checks of
//! `doctor`.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod doctor;
mod ps;
mod watch;
