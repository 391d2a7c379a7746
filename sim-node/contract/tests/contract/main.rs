//! What programs may rely on when they use the crate: each file says what it proves and how.
#![allow(clippy::unwrap_used, reason = "an error fails the test, in its helpers as well")]

mod commands;
mod late_joiner;
mod layout;
mod load;
mod ownership;
mod readers;
mod states;
mod support;
