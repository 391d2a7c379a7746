//! The guarantees of the crate. Each file states what it proves and how.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "an error fails the test, also in helpers"
)]

mod commands;
mod forces;
mod late_joiner;
mod layout;
mod load;
mod ownership;
mod readers;
mod services_page;
mod states;
mod support;
