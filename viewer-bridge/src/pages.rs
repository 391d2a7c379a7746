//! The pages: their server, and the sink that feeds them.

pub mod assets;
mod connection;
pub mod hub;
pub mod server;
mod session;
