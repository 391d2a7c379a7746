//! The sink for viewers that speak the Foxglove protocol.
//!
//! The topics are those of a recording, with the same bytes, and `/scene` with sticks and surface.
//! Parameters, service calls and published commands become requests to the source, like the commands
//! of pages.

mod callbacks;
mod options;
mod parameters;
mod playback;
mod proxy;
mod publisher;
mod request_bridge;
mod server;
mod sink;
#[cfg(test)]
mod tests;

pub use options::{FoxgloveOptions, FoxglovePermission, FoxgloveServerError};
pub use server::FoxgloveServer;
