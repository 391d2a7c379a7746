//! The client API for C and C++: `libcatenary` and its header, `include/catenary.h`.
//!
//! Each function of the header is a thin call of [`sim_contract::Client`]. The comments of this crate's
//! functions and types are the comments of the header, so they speak to C programs; a test generates the header
//! and compares it.
//!
//! - No panic crosses the boundary: [`outcome::guard`] turns it into a result.
//! - Handles are numbers, not addresses ([`handles`]), so a handle that was released is an error.
//! - The constructors of most commands are generated from the table of actions, by the test of the header.
//! - The few reads through pointers of the program are in [`pointers`].

mod attached;
mod client;
mod commands;
#[rustfmt::skip]
mod constructors;
mod forces;
mod handles;
mod lists;
mod lockstep;
mod names;
mod outcome;
mod pointers;
mod requests;
mod snapshots;

pub use attached::ClientHandle;
pub use client::*;
pub use commands::*;
pub use constructors::*;
pub use forces::*;
pub use lists::*;
pub use lockstep::*;
pub use names::*;
pub use outcome::{CatenaryResult, catenary_last_error};
pub use requests::*;
pub use snapshots::*;
